// Recordings: opening them with the file picker or by drag and drop, and the playback bar with its time line.
import {clockOffsetS, reportOf, type Finding, type Mark, type Report} from '../model/marks.js';
import type {Session} from '../model/session.js';
import type {MeshState} from '../protocol/assembler.js';
import {NoRecording, type Entry} from '../protocol/recording.js';
import {Player} from '../transport/player.js';
import {byId, setText, toast} from './dom.js';
import {droppedFiles, sessionFiles} from './session_files.js';
import {clock} from './time.js';
import {Timeline} from './timeline.js';

export class Playback {
  player: Player | null = null;
  /** 'none', 'reading', 'ready' or an error message. */
  state = 'none';
  /** How many recordings were opened. */
  opened = 0;
  /** The score that was opened with the recording. */
  private report: Report = NO_REPORT;
  /** Whether what is about to be shown is the running session's, which goes on meanwhile. */
  freezes = false;
  /** Called when another recording, or another report of it, is shown. */
  onOpened: () => void = () => {};
  private startS = 0;
  private offsetS = 0;
  private readonly timeline = new Timeline(byId<HTMLCanvasElement>('pb-marks'), (timeS) => this.jump(timeS));

  /** `before` is called when a recording was read whole and is to be shown; a file that is none changes nothing. */
  constructor(private readonly session: Session, private readonly before: () => void) {
    for (const [id, buttons] of [['file', ['open', 'empty-open']], ['folder', ['debrief-folder']]] as const) {
      const input = byId<HTMLInputElement>(id);
      for (const button of buttons) byId(button).addEventListener('click', () => input.click());
      input.addEventListener('change', () => {
        if (input.files?.length) void this.openFiles([...input.files]);
        input.value = '';
      });
    }
    byId('pb-play').addEventListener('click', () => this.toggle());
    byId('pb-back').addEventListener('click', () => this.toMark(-1));
    byId('pb-next').addEventListener('click', () => this.toMark(1));
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
      if (event.dataTransfer) void droppedFiles(event.dataTransfer).then((files) => this.openFiles(files));
    });
  }

  /** Those of a session's directory, or a recording. A report alone is that of the recording that is open. */
  async openFiles(files: readonly File[]): Promise<void> {
    const {recording, report} = sessionFiles(files);
    if (!recording && !(report && this.player)) return toast(this.state = 'There is no recording (.brachy) among these files.', true);
    try {
      const read: unknown = report ? JSON.parse(await report.text()) : null;
      if (recording) await this.open(recording.name, recording.name, new Uint8Array(await recording.arrayBuffer()), read);
      else this.setReport(read);
    } catch (error) {
      toast(this.state = `${(report ?? recording!).name} cannot be read: ${(error as Error).message}`, true);
    }
  }

  /** `report`: the parsed file of its session's score; null: none. `name`: shown for the file. */
  async open(file: string, name: string, bytes: Uint8Array, report: unknown): Promise<void> {
    this.freezes = false;
    const read = report === null ? NO_REPORT : reportOf(report);
    await this.read(name, read, startOf(file), (progress, before) => Player.open(name, bytes, this.session, progress, before));
  }

  /** Messages of a running session, shown at their end. */
  async freeze(name: string, entries: Entry[], base: MeshState): Promise<void> {
    this.freezes = true;
    await this.read(name, NO_REPORT, 0, (_, before) => Player.openEntries(name, entries, this.session, () => {}, before, {base}));
    if (!this.player) return;
    this.player.playing = false;
    this.player.seek(this.player.durationS);
  }

  private async read(name: string, report: Report, startS: number, open: (progress: (share: number) => void, before: () => void) => Promise<Player>): Promise<void> {
    this.state = 'reading';
    toast(`Reading ${name}…`);
    try {
      this.player = await open((share) => setText(byId('pb-time'), `reading ${Math.round(100 * share)} %`), this.before);
      this.player.speed = Number(byId<HTMLSelectElement>('pb-speed').value);
      this.report = report;
      this.startS = startS;
      const seek = byId<HTMLInputElement>('pb-seek');
      seek.max = String(this.player.durationS);
      seek.step = String(Math.max(this.player.durationS / 5000, 0.01));
      setText(byId('pb-damage'), this.player.damage);
      this.showMarks();
      this.state = 'ready';
      this.opened += 1;
      this.player.play();
    } catch (error) {
      this.state = error instanceof NoRecording ? error.message : `${name} cannot be read: ${(error as Error).message}`;
      toast(this.state, true);
    }
  }

  private setReport(report: unknown): void {
    this.report = reportOf(report);
    this.showMarks();
  }

  private showMarks(): void {
    this.offsetS = clockOffsetS(this.report, this.player?.marks ?? []) ?? -this.startS - (this.player?.beginsAtS ?? 0);
    this.timeline.show(this.marks, this.player?.durationS ?? 0);
    this.onOpened();
  }

  /** What is shown, on the session's clock, s. */
  get sessionS(): number {
    return (this.player?.positionS ?? NaN) - this.offsetS;
  }

  get findings(): readonly Finding[] {
    return this.report.findings;
  }

  /** When a finding was, in the recording; null: it is of no moment in it. */
  timeOf(finding: Finding): number | null {
    if (finding.atS === null || !this.player) return null;
    const timeS = finding.atS + this.offsetS;
    return timeS < -1 || timeS > this.player.durationS + 1 ? null : Math.min(Math.max(timeS, 0), this.player.durationS);
  }

  /** What stands out, with the findings of the report, in the order of its time. */
  get marks(): Mark[] {
    const found = this.findings.flatMap((finding): Mark[] => {
      const timeS = this.timeOf(finding);
      return timeS === null ? [] : [{timeS, kind: 'finding', text: finding.text}];
    });
    return [...(this.player?.marks ?? []), ...found].sort((a, b) => a.timeS - b.timeS);
  }

  close(): void {
    this.player = null;
    this.report = NO_REPORT;
    this.state = 'none';
    this.showMarks();
  }

  toggle(): void {
    if (!this.player) return;
    if (this.player.playing) this.player.playing = false;
    else this.player.play();
  }

  step(seconds: number): void {
    this.player?.seek(this.player.positionS + seconds);
  }

  /** Goes there and rests. */
  jump(timeS: number): void {
    if (!this.player) return;
    this.player.playing = false;
    this.player.seek(timeS);
  }

  /** To the next mark, or the one before. */
  toMark(direction: 1 | -1): void {
    if (!this.player) return;
    const nowS = this.player.positionS;
    const mark = direction > 0 ? this.marks.find(({timeS}) => timeS > nowS + SAME_S) : this.marks.findLast(({timeS}) => timeS < nowS - SAME_S);
    if (mark) this.jump(mark.timeS);
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
    this.timeline.draw(player.positionS);
  }
}

const SAME_S = 0.02;
const NO_REPORT: Report = {findings: [], seedsS: new Map()};

/** The session time at which a session's recording begins: the daemon names it so. */
const startOf = (name: string): number => Number(/recording_(\d+)\.brachy$/.exec(name)?.[1] ?? 0) / 1000;
