// This viewer's copy of the mesh, by the rules of net/wire/frame_assembler.h: after each frame it holds the bits that the
// server held.
import type {Frame, Seed} from './frame.js';
import type {Topology} from './topology.js';

/** Everything that a later frame builds on: what a keyframe of a recording stores. */
export interface MeshState {
  tick: number;
  hasFrame: boolean;
  positions: Float32Array;
  seeds: Seed[];
}

export class FrameAssembler {
  private hash = 0n;
  private hasTopology = false;
  private hasFrame = false;
  tick = 0;
  positions: Float32Array = new Float32Array();
  seeds: Seed[] = [];

  /** Starts over at rest, in `storage` (3N) where given. Returns '' or why the topology is refused. */
  start(topology: Topology, storage?: Float32Array): string {
    if (!topology.hashHolds) return "the topology's hash does not match its content";
    this.hash = topology.hash;
    this.tick = 0;
    this.hasTopology = true;
    this.hasFrame = false;
    this.positions = storage ?? new Float32Array(topology.restPositions.length);
    this.positions.set(topology.restPositions);
    this.seeds = [];
    return '';
  }

  /** Returns '' or why the frame is refused; a refused one changes nothing. */
  apply(frame: Frame): string {
    if (!this.hasTopology) return 'a frame came before the topology';
    if (frame.topologyHash !== this.hash) return 'the frame belongs to another topology';
    if (3 * frame.pointCount !== this.positions.length) return 'the frame has another number of points';
    if (!frame.full) {
      if (!this.hasFrame) return 'the first frame is not a full one';
      if (frame.baseTick > this.tick) return "the frame's base tick is later than this mesh's tick";
      if (frame.tick < this.tick) return 'the frame is older than this mesh';
    }
    if (!this.addsUp(frame)) return 'the frame lacks seeds that this mesh has not';
    let from = 0;
    for (let i = 0; i < frame.ranges.length; i += 2) {
      const count = 3 * frame.ranges[i + 1]!;
      this.positions.set(frame.positions.subarray(from, from + count), 3 * frame.ranges[i]!);
      from += count;
    }
    if (frame.full && (!frame.seeds || this.seeds.length > frame.seeds.count)) this.seeds = [];
    if (frame.seeds) for (const seed of frame.seeds.entries) this.seeds[seed.id - 1] = seed;
    this.tick = frame.tick;
    this.hasFrame = true;
    return '';
  }

  save(): MeshState {
    return {tick: this.tick, hasFrame: this.hasFrame, positions: this.positions.slice(), seeds: this.seeds.slice()};
  }

  restore(state: MeshState): void {
    this.tick = state.tick;
    this.hasFrame = state.hasFrame;
    this.positions.set(state.positions);
    this.seeds = state.seeds.slice();
  }

  // Seeds are never taken out: those that are new here must be in the frame.
  private addsUp(frame: Frame): boolean {
    if (!frame.seeds) return frame.full || this.seeds.length === 0;
    const known = frame.full ? 0 : this.seeds.length;
    if (frame.seeds.count < known) return false;
    return frame.seeds.entries.filter((seed) => seed.id > known).length === frame.seeds.count - known;
  }
}
