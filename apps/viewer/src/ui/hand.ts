// The panel "Manual needle": takes the lease, moves the needle, presses the device's button.
import type {Session} from '../model/session.js';
import type {Settings} from '../model/settings.js';
import {holeOf} from '../protocol/scene_message.js';
import {Device} from '../transport/device.js';
import type {Endpoint} from '../transport/endpoint.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, setDisabled, setText, toast} from './dom.js';

const FASTEST_MM_S = 120;  // a jump of the mouse moves the needle at the speed of a hand
const CLEAR_MM = 12;       // in front of the gland, where the needle starts

export class HandPanel {
  /** Target of the tip, and the position sent last; mm, the shaft along +z. */
  readonly target = [0, 0, 0];
  private readonly tip = [0, 0, 0];
  private device: Device | null = null;
  private pressed = false;
  private holes = '';

  constructor(private readonly endpoint: Endpoint, private readonly session: Session, private readonly live: LiveConnection,
              private readonly settings: Settings, private readonly scriptPlays: () => boolean,
              private readonly shownNeedle: () => number,
              private readonly chooseHole: (hole: string) => void) {
    byId('take').addEventListener('click', () => this.toggle());
    byId<HTMLSelectElement>('hole').addEventListener('change', (event) => this.goToHole((event.target as HTMLSelectElement).value));
    const drop = byId('drop');
    drop.addEventListener('pointerdown', () => this.press(true));
    for (const end of ['pointerup', 'pointercancel', 'pointerleave']) drop.addEventListener(end, () => this.press(false));
    drop.addEventListener('keydown', (event) => {
      if (event.key === 'Enter' || event.key === ' ') this.press(true);
    });
    drop.addEventListener('keyup', () => this.press(false));
    addEventListener('blur', () => this.press(false));  // the key release would not be delivered to this page
  }

  /** Whether the mouse is the needle's device. */
  get held(): boolean {
    return this.device !== null && this.device.needle >= 0;
  }
  get locked(): boolean {
    return this.hole !== null;
  }

  private get hole(): {column: number; row: number} | null {
    return this.session.scene ? holeOf(this.settings.hole, this.session.scene.template) : null;
  }

  toggle(): void {
    if (this.device) return this.device.end();
    if (byId<HTMLButtonElement>('take').disabled) return;
    this.start();
    this.device = new Device(this.endpoint, -1, (elapsedS) => this.pose(elapsedS), (reason) => this.ended(reason), () => this.show());
    this.show();
  }

  press(pressed: boolean): void {
    if (pressed === this.pressed || (pressed && byId<HTMLButtonElement>('drop').disabled)) return;
    this.pressed = pressed;
    if (this.held) this.device!.press(pressed);
    else this.live.press(this.shownNeedle(), pressed);
  }

  move(dx: number, dy: number, dz: number): void {
    if (!this.locked) {
      this.target[0]! += dx;
      this.target[1]! += dy;
    }
    this.target[2]! += dz;
  }

  /** Releases the needle: the page is hidden, or shows a recording. */
  release(): void {
    this.device?.end();
  }

  private goToHole(hole: string): void {
    this.chooseHole(hole);
    if (this.held && this.hole) this.start();
  }

  /** In front of the gland, in line with the hole or with the gland's middle. */
  private start(): void {
    const rest = this.session.topology!.restPositions;
    const surface = this.session.topology!.surfaceVertexCount;
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < 3 * surface; ++i) {
      low[i % 3] = Math.min(low[i % 3]!, rest[i]!);
      high[i % 3] = Math.max(high[i % 3]!, rest[i]!);
    }
    const grid = this.session.scene?.template;
    const hole = this.hole;
    this.target[0] = hole && grid ? grid.origin[0] + hole.column * grid.spacingMm : (low[0]! + high[0]!) / 2;
    this.target[1] = hole && grid ? grid.origin[1] + hole.row * grid.spacingMm : (low[1]! + high[1]!) / 2;
    this.target[2] = low[2]! - CLEAR_MM;
    this.tip.splice(0, 3, ...this.target);
  }

  private pose(elapsedS: number): Float64Array {
    const way = this.target.map((value, axis) => value - this.tip[axis]!);
    const length = Math.hypot(...way);
    const share = Math.min(1, (FASTEST_MM_S * Math.min(elapsedS, 0.05)) / (length || 1));
    way.forEach((value, axis) => (this.tip[axis]! += share * value));
    return Float64Array.of(1, 0, 0, this.tip[0]!, 0, 1, 0, this.tip[1]!, 0, 0, 1, this.tip[2]!);
  }

  private ended(reason: string): void {
    this.device = null;
    this.pressed = false;
    if (reason !== 'released') toast(`The needle was not granted or was lost: ${reason}`, true);
    this.show();
  }

  private show(): void {
    byId('view').classList.toggle('by-hand', this.held);
    byId('take').setAttribute('aria-pressed', String(this.device !== null));
    setText(byId('take'), this.device ? (this.held ? 'Release the needle' : 'Requesting…') : 'Take the needle');
  }

  update(): void {
    const open = this.live.status.phase === 'open';
    setDisabled('take', !this.device && (!open || !this.session.topology));
    setDisabled('drop', !this.held && !(this.live.mayControl && this.scriptPlays()));
    const scene = this.session.scene;
    const names = scene ? holeNames(scene.template, this.session.plannedHoles()) : [];
    const key = names.join();
    if (key === this.holes) return;
    this.holes = key;
    const planned = new Set(this.session.plannedHoles());
    byId<HTMLSelectElement>('hole').replaceChildren(
      new Option('free', ''), ...names.map((name) => new Option(planned.has(name) ? `${name} · planned` : name, name)));
    byId<HTMLSelectElement>('hole').value = this.settings.hole;
  }
}

/** The holes, those of the plan first. */
function holeNames(grid: {columns: number; rows: number}, planned: string[]): string[] {
  const names = [...new Set(planned)];
  for (let column = 0; column < grid.columns; ++column)
    for (let row = 1; row <= grid.rows; ++row) {
      const name = `${String.fromCharCode(65 + column)}${row}`;
      if (!names.includes(name)) names.push(name);
    }
  return names;
}
