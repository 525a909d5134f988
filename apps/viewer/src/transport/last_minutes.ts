// The newest messages of a running session, so that it can be frozen and looked at again: at most so many bytes and minutes, the
// oldest dropped. Images are not kept.
import {FrameAssembler, type MeshState} from '../protocol/assembler.js';
import type {Message} from '../protocol/message.js';
import type {Entry} from '../protocol/recording.js';

const MOST_BYTES = 100e6;
const MOST_S = 300;
const SEGMENT_S = 5;

/** Messages from a frame on, and what was there before it. */
interface Segment {
  base: MeshState;
  /** The newest TOPOLOGY, SCENE, PLAN, STATE and DOSE before it. */
  before: Entry[];
  entries: Entry[];
  bytes: number;
  fromNs: number;
}

const KEPT_BEFORE = ['topology', 'scene', 'plan', 'state', 'dose'];

export class LastMinutes {
  private segments: Segment[] = [];
  private readonly newest = new Map<string, Entry>();
  private readonly assembler = new FrameAssembler();
  private hash: bigint | null = null;
  private lastNs = 0;
  private lastTick = 0;
  bytes = 0;

  constructor(private readonly mostBytes = MOST_BYTES, private readonly mostS = MOST_S) {}

  /** Of time; 0 before the first frame. */
  get seconds(): number {
    return this.segments.length === 0 ? 0 : (this.lastNs - this.segments[0]!.fromNs) / 1e9;
  }

  clear(): void {
    this.segments = [];
    this.newest.clear();
    this.hash = null;
    this.bytes = 0;
    this.lastNs = 0;
    this.lastTick = 0;
  }

  /** `bytes` is the whole message. */
  add(message: Message, bytes: Uint8Array): void {
    const {header, kind} = message;
    if (kind !== 'frame' && kind !== 'event' && !KEPT_BEFORE.includes(kind)) return;
    const isOther = kind === 'topology' && (message.body.hash !== this.hash);
    if (isOther || header.stampNs < this.lastNs - 1e9) this.clear();  // another scene, or another daemon's clock
    const entry: Entry = {type: header.type, stampNs: header.stampNs, bytes};
    if (kind === 'topology') {
      if (this.assembler.start(message.body) !== '') return this.clear();
      this.hash = message.body.hash;
      this.newest.set(kind, entry);
      this.begin(header.stampNs);
      return;
    }
    if (this.hash === null) return;
    if (kind === 'frame') {
      if (message.body.tick < this.lastTick) {  // the simulation began again
        this.segments = [];
        this.bytes = 0;
        this.begin(header.stampNs);
      } else if (header.stampNs - this.segments.at(-1)!.fromNs > SEGMENT_S * 1e9) {
        this.begin(header.stampNs);
      }
      if (this.assembler.apply(message.body) !== '') return this.clear();
      this.lastNs = Math.max(this.lastNs, header.stampNs);
      this.lastTick = message.body.tick;
    }
    if (kind !== 'frame' && kind !== 'event') this.newest.set(kind, entry);
    const segment = this.segments.at(-1)!;
    segment.entries.push(entry);
    segment.bytes += bytes.byteLength;
    this.bytes += bytes.byteLength;
    while (this.segments.length > 1 && (this.bytes > this.mostBytes || (this.lastNs - this.segments[1]!.fromNs) / 1e9 > this.mostS)) this.bytes -= this.segments.shift()!.bytes;
    if (this.bytes > this.mostBytes) this.clear();  // in 5 seconds
  }

  /** As a recording; null: there is nothing yet. */
  recording(): {entries: Entry[]; base: MeshState} | null {
    const first = this.segments[0];
    if (!first || this.seconds <= 0) return null;
    return {entries: [...first.before, ...this.segments.flatMap((segment) => segment.entries)], base: first.base};
  }

  private begin(fromNs: number): void {
    const base = this.assembler.save();
    const before = KEPT_BEFORE.flatMap((kind) => this.newest.get(kind) ?? []);
    const bytes = base.positions.byteLength + before.reduce((sum, entry) => sum + entry.bytes.byteLength, 0);
    this.segments.push({base, before, entries: [], bytes, fromNs});
    this.bytes += bytes;
  }
}
