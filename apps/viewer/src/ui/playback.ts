// Recordings: opening them with the file picker or by drag and drop, and the playback bar.
import type {Session} from '../model/session.js';
import {NoRecording} from '../protocol/recording.js';
import {Player} from '../transport/player.js';
import {byId, setText, toast} from './dom.js';

export class Playback {
  player: Player | null = null;
  /** 'none', 'reading', 'ready' or an error message. */
  state = 'none';

  /** `before` is called when a recording was read whole and is to be shown; a file that is none changes nothing. */
  constructor(private readonly session: Session, private readonly before: () => void) {
    const file = byId<HTMLInputElement>('file');
    for (const id of ['open', 'empty-open']) byId(id).addEventListener('click', () => file.click());
    file.addEventListener('change', () => {
      if (file.files?.[0]) void this.open(file.files[0]);
      file.value = '';
    });
    byId('pb-play').addEventListener('click', () => this.toggle());
    byId<HTMLInputElement>('pb-seek').addEventListener('input', (event) => this.player?.seek(Number((event.target as HTMLInputElement).value)));
    byId<HTMLSelectElement>('pb-speed').addEventListener('change', (event) => {
      if (this.player) this.player.speed = Number((event.target as HTMLSelectElement).value);
    });
    let depth = 0;
    addEventListener('dragenter', (event) => {
      event.preventDefault();
      byId('drop-here').hidden = ++depth === 0;
    });
    addEventListener('dragleave', () => (byId('drop-here').hidden = --depth <= 0));
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', (event) => {
      event.preventDefault();
      depth = 0;
      byId('drop-here').hidden = true;
      if (event.dataTransfer?.files[0]) void this.open(event.dataTransfer.files[0]);
    });
  }

  async open(file: File): Promise<void> {
    this.state = 'reading';
    toast(`Reading ${file.name}…`);
    try {
      const bytes = new Uint8Array(await file.arrayBuffer());
      this.player = await Player.open(file.name, bytes, this.session, (share) => setText(byId('pb-time'), `reading ${Math.round(100 * share)} %`), this.before);
      this.player.speed = Number(byId<HTMLSelectElement>('pb-speed').value);
      const seek = byId<HTMLInputElement>('pb-seek');
      seek.max = String(this.player.durationS);
      seek.step = String(Math.max(this.player.durationS / 5000, 0.01));
      setText(byId('pb-damage'), this.player.damage);
      this.state = 'ready';
      this.player.play();
    } catch (error) {
      this.state = error instanceof NoRecording ? error.message : `${file.name} cannot be read: ${(error as Error).message}`;
      toast(this.state, true);
    }
  }

  close(): void {
    this.player = null;
    this.state = 'none';
  }

  toggle(): void {
    if (!this.player) return;
    if (this.player.playing) this.player.playing = false;
    else this.player.play();
  }

  step(seconds: number): void {
    this.player?.seek(this.player.positionS + seconds);
  }

  update(): void {
    const player = this.player;
    byId('playback').hidden = player === null;
    byId('live').hidden = player === null || !location.protocol.startsWith('http');
    if (!player) return;
    setText(byId('pb-play'), player.playing ? '⏸' : '▶');
    setText(byId('pb-time'), `${clock(player.positionS)} / ${clock(player.durationS)}`);
    const seek = byId<HTMLInputElement>('pb-seek');
    if (document.activeElement !== seek || player.playing) seek.value = String(player.positionS);
  }
}

const clock = (seconds: number): string => `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, '0')}`;
