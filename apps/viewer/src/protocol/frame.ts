// FRAME: a snapshot of the simulation, with the sections that a viewer shows.
import {ByteReader, ProtocolError} from './bytes.js';
import {FrameFlag, SeedFlag, readFrame} from './wire_generated.js';
import type {Forces, Frame as WireFrame, FrameCertificate, FrameSeeds, Needle as WireNeedle, NeedleShape, Seed as WireSeed} from './wire_generated.js';

export const ContactState = ['free', 'touching', 'inserted', 'through', 'withdrawn'];

/** Bits of Frame.stepFlags; those that the page shows. */
export const StepFlag = {Late: 1 << 10, Steep: 1 << 11} as const;

export interface NeedleForces extends Forces {
  /** Header sequence of the POSE that the tick used. */
  inputSequence: number;
  tipDepthMm: number;
}

/** `pose`: X_WN, 3×4 row by row. */
export interface Needle extends WireNeedle {
  forces: NeedleForces | null;
  /** The course of a needle that bends, `points` from the hub to the tip at equal arc lengths, mm. Null: it is straight. */
  shape: NeedleShape | null;
}

export interface Seed extends Omit<WireSeed, 'flags'> {
  certified: boolean;
}

export interface Certificate extends Omit<FrameCertificate, 'verdict'> {
  verdict: 'injective' | 'folded' | 'unknown';
}

/** `ranges`: first, count of each; `positions`: 3 for each point of the ranges in order, mm. */
export interface Frame extends Omit<WireFrame, 'frameFlags' | 'needles' | 'sections'> {
  full: boolean;
  needles: Needle[];
  seeds: {count: number; entries: Seed[]} | null;
  certificate: Certificate | null;
  /** How far the points shown lag behind the tick's field, at most, mm. Null: not known, of an earlier daemon. */
  lagMm: number | null;
}

function checkRanges(frame: Frame): void {
  let points = 0;
  let end = 0;
  for (let i = 0; i < frame.ranges.length; i += 2) {
    const first = frame.ranges[i]!;
    const count = frame.ranges[i + 1]!;
    if (count === 0) throw new ProtocolError('a range is empty');
    if (first < end) throw new ProtocolError('the ranges are out of order or overlap');
    end = first + count;
    if (end > frame.pointCount) throw new ProtocolError('a range goes past the last point');
    points += count;
  }
  if (frame.full && (frame.baseTick !== 0 || points !== frame.pointCount || frame.ranges.length > 2))
    throw new ProtocolError('a full frame must have base tick 0 and one range with every point');
}

function seedsOf({seedCount: count, entries}: FrameSeeds): {count: number; entries: Seed[]} {
  let before = 0;
  for (const {id} of entries) {
    if (id <= before || id > count) throw new ProtocolError("the seeds' ids are out of order or beyond their count");
    before = id;
  }
  return {count, entries: entries.map(({flags, ...seed}) => ({...seed, certified: (flags & SeedFlag.Certified) !== 0}))};
}

export function decodeFrame(body: Uint8Array): Frame {
  const {frameFlags, needles, sections, ...rest} = readFrame(new ByteReader(body));
  const {force, seeds, certificate, needleShapes, lag} = sections;
  const frame: Frame = {
    ...rest, full: (frameFlags & FrameFlag.Full) !== 0, needles: needles.map((needle) => ({...needle, forces: null, shape: null})),
    seeds: seeds && seedsOf(seeds),
    certificate: certificate && {...certificate, verdict: (['unknown', 'injective', 'folded'] as const)[certificate.verdict] ?? 'unknown'},
    lagMm: lag && lag.lagMm,
  };
  checkRanges(frame);
  if (frame.baseTick > frame.tick) throw new ProtocolError("a frame's base tick is later than its tick");
  for (const entry of force?.entries ?? []) {
    const needle = frame.needles.find(({id}) => id === entry.needle);
    if (!needle) throw new ProtocolError('a force names a needle that is not there');
    needle.forces = {...entry.forces, inputSequence: entry.inputSequence, tipDepthMm: entry.tipDepthMm};
  }
  for (const shape of needleShapes?.entries ?? []) {
    const needle = frame.needles.find(({id}) => id === shape.needle);
    if (!needle?.present) throw new ProtocolError('a shape names a needle that is not there');
    needle.shape = shape;
  }
  return frame;
}
