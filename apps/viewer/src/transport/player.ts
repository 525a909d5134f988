// A recording as a source: the recorded messages, at the chosen speed and from the chosen time.
import {History} from '../model/history.js';
import {MissedTicks, markOfEvent, type Mark} from '../model/marks.js';
import {recordFrame, recordState, type LoggedEvent, type Session} from '../model/session.js';
import {FrameAssembler, type MeshState} from '../protocol/assembler.js';
import {ProtocolError} from '../protocol/bytes.js';
import {MessageType} from '../protocol/header.js';
import {decodeMessage, type Message} from '../protocol/message.js';
import {NoRecording, RecordingReader, type Entry} from '../protocol/recording.js';

const KEYFRAME_BYTES = 128e6;
const LEAST_FRAMES_APART = 30;
const SLICE_MS = 25;

interface Keyframe {
  index: number;
  mesh: MeshState;
  /** Indices of the newest STATE, DOSE and PLAN before it, −1 for none. */
  state: number;
  dose: number;
  plan: number;
}

export class Player {
  readonly durationS: number;
  positionS = 0;
  playing = false;
  speed = 1;
  private next = 0;
  private readonly startNs: number;
  /** Which entries are FRAMEs. */
  private readonly frames: number[];

  private constructor(
    private readonly session: Session, readonly name: string, private readonly entries: Entry[],
    private readonly keyframes: Keyframe[], private readonly history: History, private readonly events: LoggedEvent[],
    /** What stands out, in the order of its time. */
    readonly marks: Mark[],
    /** The simulated time of the first frame: that of the session, of a recording which began with it. */
    readonly beginsAtS: number, readonly damage: string) {
    this.frames = entries.flatMap((entry, i) => (entry.type === MessageType.Frame ? [i] : []));
    this.startNs = entries[this.frames[0]!]!.stampNs;
    this.durationS = (entries[this.frames.at(-1)!]!.stampNs - this.startNs) / 1e9;
    session.recordsHistory = false;
    session.forget();
    session.history = history;
    this.seek(0);
  }

  /** Reads the whole file once, in slices that keep the page responsive; `progress` gets 0 … 1. Throws NoRecording where there is nothing
   * to play, and leaves the session as it is; `before` is called when it is about to be the recording's. */
  static async open(name: string, file: Uint8Array, session: Session, progress: (share: number) => void, before: () => void = () => {}): Promise<Player> {
    const pause = slices(progress);
    const reader = new RecordingReader(file);
    const entries: Entry[] = [];
    for (let entry = reader.next(); entry; entry = reader.next()) {
      entries.push(entry);
      await pause(0.5 * reader.progress);
    }
    return Player.openEntries(name, entries, session, (share) => pause(0.5 + 0.5 * share), before, {damage: reader.damage});
  }

  /** As open(), of messages in memory. `base`: the mesh before the first frame; none: that is a full one. */
  static async openEntries(name: string, entries: Entry[], session: Session, pause: (share: number) => Promise<void> | void, before: () => void, {base, damage = ''}: {base?: MeshState; damage?: string}): Promise<Player> {
    const assembler = new FrameAssembler();
    const missed = new MissedTicks();
    const marks: Mark[] = [];
    let beginsAtS = NaN;
    const history = new History();
    const events: LoggedEvent[] = [];
    const keyframes: Keyframe[] = [];
    let startNs = NaN;
    let apart = LEAST_FRAMES_APART;
    let sinceKeyframe = Infinity;
    let state = -1;
    let dose = -1;
    let plan = -1;
    for (let i = 0; i < entries.length; ++i) {
      const problem = take(i);
      if (problem) {
        damage = `Message ${i + 1} of the file is invalid (${problem}); the recording is shown up to there.`;
        entries.length = i;
        break;
      }
      await pause(i / entries.length);
    }
    if (!entries.some((entry) => entry.type === MessageType.Frame)) throw new NoRecording(`${name} holds no snapshot. ${damage}`);
    before();
    const all = [...marks, ...missed.marks].sort((a, b) => a.timeS - b.timeS);
    return new Player(session, name, entries, keyframes, history, events, all, beginsAtS, damage);

    function take(index: number): string {
      let message: Message;
      try {
        message = decodeMessage(entries[index]!.bytes);
      } catch (error) {
        if (error instanceof ProtocolError) return error.message;
        throw error;
      }
      if (message.kind === 'frame' && Number.isNaN(startNs)) startNs = message.header.stampNs;
      const timeS = Math.max(0, (message.header.stampNs - startNs) / 1e9 || 0);
      if (message.kind === 'topology') {
        const refusal = assembler.start(message.body);
        if (refusal) return refusal;
        if (base && keyframes.length === 0) assembler.restore(base);
        const frames = entries.filter((entry) => entry.type === MessageType.Frame).length;
        apart = Math.max(LEAST_FRAMES_APART, Math.ceil((frames * assembler.positions.byteLength) / KEYFRAME_BYTES));
        sinceKeyframe = Infinity;
      } else if (message.kind === 'frame') {
        if (sinceKeyframe >= apart) {
          keyframes.push({index, mesh: assembler.save(), state, dose, plan});
          sinceKeyframe = 0;
        }
        sinceKeyframe += 1;
        const refusal = assembler.apply(message.body);
        if (refusal) return refusal;
        recordFrame(history, message.body, timeS);
        missed.add(message.body.overruns, timeS);
        if (Number.isNaN(beginsAtS)) beginsAtS = message.body.simTimeS;
      } else if (message.kind === 'state') {
        state = index;
        recordState(history, message.body, timeS);
      } else if (message.kind === 'dose') {
        dose = index;
      } else if (message.kind === 'plan') {
        plan = index;
      } else if (message.kind === 'event') {
        events.push({...message.body, timeS});
        const mark = markOfEvent(message.body, timeS);
        if (mark) marks.push(mark);
      }
      return '';
    }
  }

  play(): void {
    if (this.positionS >= this.durationS) this.seek(0);
    this.playing = true;
  }

  /** Advances by `elapsedS` of real time. */
  advance(elapsedS: number): void {
    if (!this.playing) return;
    this.seek(this.positionS + this.speed * elapsedS);
    if (this.positionS >= this.durationS) this.playing = false;
  }

  seek(seconds: number): void {
    this.positionS = Math.min(Math.max(seconds, 0), this.durationS);
    const untilNs = this.startNs + this.positionS * 1e9;
    const end = this.endOf(untilNs);
    const keyframe = this.keyframes.findLast((candidate) => candidate.index < end);
    if (keyframe && (end < this.next || keyframe.index > this.next)) this.restore(keyframe);
    for (; this.next < end; ++this.next) {
      const entry = this.entries[this.next]!;
      if (entry.type !== MessageType.Event && entry.type !== MessageType.Error) this.session.apply(decodeMessage(entry.bytes));
    }
    this.history.nowS = this.positionS;
    const shown = this.events.filter((event) => event.timeS <= this.positionS);
    if (shown.length !== this.session.events.length) {
      this.session.events = shown;
      this.session.versions.events += 1;
    }
  }

  /** Index after the last message to show: the last FRAME by then, and all messages before the next one. */
  private endOf(untilNs: number): number {
    let low = 1;  // the first is always shown
    let high = this.frames.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.entries[this.frames[middle]!]!.stampNs <= untilNs) low = middle + 1;
      else high = middle;
    }
    return this.frames[low] ?? this.entries.length;
  }

  private restore(keyframe: Keyframe): void {
    if (this.next === 0)  // the mesh, the scene: once
      for (let i = 0; i < this.frames[0]!; ++i)
        this.session.apply(decodeMessage(this.entries[i]!.bytes));
    this.session.assembler.restore(keyframe.mesh);
    this.session.frame = null;
    this.session.dose = null;
    this.session.versions.dose += 1;
    for (const index of [keyframe.state, keyframe.dose, keyframe.plan])
      if (index >= 0) this.session.apply(decodeMessage(this.entries[index]!.bytes));
    this.session.allPointsChanged();
    this.next = keyframe.index;
  }
}

/** Yields to the page whenever a slice of time is used up. */
function slices(progress: (share: number) => void): (share: number) => Promise<void> | void {
  let since = performance.now();
  return (share) => {
    if (performance.now() - since < SLICE_MS) return;
    progress(share);
    return new Promise((resolve) => setTimeout(() => {
      since = performance.now();
      resolve();
    }));
  };
}
