// The panel of the image volume: fetched from the daemon once a connection is open, shown in slices.
import type {Settings, VolumeSettings} from '../model/settings.js';
import {boxOf, parseVolume, type ShownVolume} from '../protocol/volume.js';
import type {Endpoint} from '../transport/endpoint.js';
import {byId, setText, toast} from './dom.js';

const AXES = [['sagittal', 0], ['coronal', 1], ['axial', 2]] as const;

export class VolumePanel {
  /** For tests: what was fetched last. */
  volume: ShownVolume | null = null;
  private fetched = 0;

  constructor(private readonly endpoint: Endpoint, private readonly settings: Settings, private readonly change: (some: Partial<Settings>) => void,
              private readonly onVolume: (volume: ShownVolume | null) => void) {
    for (const [name, axis] of AXES) {
      byId<HTMLInputElement>(`volume-${name}`).addEventListener('change', (event) => this.set({planes: replaced(this.settings.volume.planes, axis, (event.target as HTMLInputElement).checked)}));
      byId<HTMLInputElement>(`volume-${name}-at`).addEventListener('input', (event) => this.set({
        planes: replaced(this.settings.volume.planes, axis, true), shares: replaced(this.settings.volume.shares, axis, Number((event.target as HTMLInputElement).value))}));
    }
    byId<HTMLInputElement>('volume-level').addEventListener('input', (event) => this.set({level: Number((event.target as HTMLInputElement).value)}));
    byId<HTMLInputElement>('volume-width').addEventListener('input', (event) => this.set({width: Number((event.target as HTMLInputElement).value)}));
  }

  /** Asks the daemon for its volume, after each connection: another daemon may have another one, or none. */
  async load(): Promise<void> {
    const turn = ++this.fetched;
    let volume: ShownVolume | null = null;
    try {
      const answer = await fetch('/volume', {cache: 'no-store', headers: this.endpoint.authorisation()});
      if (answer.status === 200) volume = parseVolume(new Uint8Array(await answer.arrayBuffer()));
    } catch (error) {
      toast(`The image volume cannot be shown: ${(error as Error).message}.`, true);
    }
    if (turn === this.fetched) this.take(volume);
  }

  clear(): void {
    this.fetched += 1;
    this.take(null);
  }

  private take(volume: ShownVolume | null): void {
    if (!volume && !this.volume) return;
    const before = this.volume;
    this.volume = volume;
    byId('volume-panel').hidden = !volume;
    this.onVolume(volume);
    if (!volume) return this.set({planes: [false, false, false]});
    const [low, high] = volume.window;
    const range = 65535 * volume.step;
    for (const [id, least, most] of [['volume-level', volume.least, volume.least + range], ['volume-width', range / 1000, range]] as const) {
      const slider = byId<HTMLInputElement>(id);
      slider.min = String(least);
      slider.max = String(most);
      slider.step = 'any';
    }
    // A reconnection keeps what was chosen.
    if (before && before.least === volume.least && before.step === volume.step) this.set({});
    else this.set({level: (low + high) / 2, width: Math.max(high - low, range / 1000)});
  }

  private set(some: Partial<VolumeSettings>): void {
    const settings = {...this.settings.volume, ...some};
    this.change({volume: settings});
    const volume = this.volume;
    if (!volume) return;
    const {low, high} = boxOf(volume);
    for (const [name, axis] of AXES) {
      byId<HTMLInputElement>(`volume-${name}`).checked = settings.planes[axis];
      byId<HTMLInputElement>(`volume-${name}-at`).value = String(settings.shares[axis]);
      setText(byId(`volume-${name}-mm`), `${(low[axis]! + settings.shares[axis] * (high[axis]! - low[axis]!)).toFixed(1)} mm`);
    }
    byId<HTMLInputElement>('volume-level').value = String(settings.level);
    byId<HTMLInputElement>('volume-width').value = String(settings.width);
    setText(byId('volume-level-value'), short(settings.level));
    setText(byId('volume-width-value'), short(settings.width));
  }
}

const short = (value: number): string => String(+value.toPrecision(4));

function replaced<T>(three: [T, T, T], at: number, value: T): [T, T, T] {
  const copy: [T, T, T] = [...three];
  copy[at] = value;
  return copy;
}
