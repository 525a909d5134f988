// FRAME: a snapshot of the simulation, with the sections that a viewer shows.
import {ByteReader, ProtocolError, type Vec3} from './bytes.js';

export const ContactState = ['free', 'touching', 'inserted', 'through', 'withdrawn'];

/** Bits of Frame.stepFlags; those that the page shows. */
export const StepFlag = {Steep: 1 << 11} as const;

export interface NeedleForces {
  force: Vec3;
  axial: number;
  lateral: number;
  cutting: number;
  friction: number;
  tipDepthMm: number;
}

/** The course of a needle that bends. */
export interface NeedleShape {
  tipAxis: Vec3;
  /** Of the tip off the pose's origin, mm. */
  tipDeflection: Vec3;
  /** x y z of each, from the hub to the tip at equal arc lengths, mm. */
  points: Float32Array;
}

export interface Needle {
  id: number;
  contact: number;
  present: boolean;
  landmarkCount: number;
  punctureCount: number;
  insertionDepthMm: number;
  /** X_WN, 3×4 row by row. */
  pose: Float64Array;
  forces: NeedleForces | null;
  /** Null: it is straight. */
  shape: NeedleShape | null;
}

export interface Seed {
  id: number;
  planned: number;
  needle: number;
  certified: boolean;
  tick: number;
  airKermaStrengthU: number;
  dropped: Vec3;
  rest: Vec3;
  position: Vec3;
  axis: Vec3;
}

export interface Certificate {
  verdict: 'injective' | 'folded' | 'unknown';
  substeps: number;
  detBound: number;
  vertexDet: number;
  place: Vec3;
  heldMm: number;
}

export interface Frame {
  topologyHash: bigint;
  tick: number;
  simTimeS: number;
  snapshotSequence: number;
  baseTick: number;
  overruns: number;
  publishNs: number;
  maxDisplacementMm: number;
  stepFlags: number;
  full: boolean;
  pointCount: number;
  movedVertices: number;
  needles: Needle[];
  /** first, count of each range. */
  ranges: Uint32Array;
  /** 3 for each point of the ranges in order, mm. */
  positions: Float32Array;
  seeds: {count: number; entries: Seed[]} | null;
  certificate: Certificate | null;
}

const NEEDLE_BYTES = 116;
const SEED_BYTES = 208;

function readNeedle(reader: ByteReader): Needle {
  const id = reader.u16();
  const contact = reader.u8();
  const present = reader.u8();
  if (present > 1) throw new ProtocolError("a needle's present field is neither 0 nor 1");
  return {
    id, contact, present: present === 1, landmarkCount: reader.u32(), punctureCount: reader.u32(),
    insertionDepthMm: reader.f64(), pose: reader.pose(), forces: null, shape: null,
  };
}

function checkRanges(frame: Frame): number {
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
  return points;
}

function readForces(reader: ByteReader, needles: Needle[]): void {
  const count = reader.u16();
  reader.u16();
  for (let i = 0; i < count; ++i) {
    const id = reader.u16();
    const needle = needles.find((candidate) => candidate.id === id);
    if (!needle) throw new ProtocolError('a force names a needle that is not there');
    reader.skip(6 + 16);
    const force = reader.vec3();
    reader.skip(48);  // moments about tip and hub
    needle.forces = {
      force, axial: reader.f64(), lateral: reader.f64(), cutting: reader.f64(), friction: reader.f64(),
      tipDepthMm: reader.f64(),
    };
  }
}

function readShapes(reader: ByteReader, needles: Needle[]): void {
  const count = reader.u16();
  reader.u16();
  for (let i = 0; i < count; ++i) {
    const id = reader.u16();
    const pointCount = reader.u16();
    reader.skip(4);
    const needle = needles.find((candidate) => candidate.id === id);
    if (!needle?.present) throw new ProtocolError('a shape names a needle that is not there');
    if (pointCount < 2) throw new ProtocolError("a needle's shape has fewer than two points");
    needle.shape = {tipAxis: reader.vec3(), tipDeflection: reader.vec3(), points: reader.f32Array(3 * pointCount)};
  }
}

function readSeeds(reader: ByteReader): {count: number; entries: Seed[]} {
  const count = reader.u32();
  const entries: Seed[] = [];
  let before = 0;
  for (let n = reader.fits(reader.u32(), SEED_BYTES); n > 0; --n) {
    const id = reader.u32();
    if (id <= before || id > count) throw new ProtocolError("the seeds' ids are out of order or beyond their count");
    before = id;
    const planned = reader.i32();
    const needle = reader.u16();
    reader.u16();  // source
    const certified = (reader.u32() & 1) !== 0;
    const tick = reader.u64();
    reader.f64();  // simulated time
    const airKermaStrengthU = reader.f64();
    const dropped = reader.vec3();
    reader.vec3();
    const rest = reader.vec3();
    reader.skip(48);  // axis at rest, motion of the gland
    entries.push({
      id, planned, needle, certified, tick, airKermaStrengthU, dropped, rest, position: reader.vec3(), axis: reader.vec3(),
    });
  }
  return {count, entries};
}

function readCertificate(reader: ByteReader): Certificate {
  const verdict = reader.u8();
  reader.skip(3);
  const substeps = reader.u32();
  const detBound = reader.f64();
  const vertexDet = reader.f64();
  const place = reader.vec3();
  reader.f64();  // margin
  const heldMm = reader.f64();
  reader.skip(16);  // force of what was held, condition number
  return {verdict: verdict === 1 ? 'injective' : verdict === 2 ? 'folded' : 'unknown', substeps, detBound, vertexDet, place, heldMm};
}

export function decodeFrame(body: Uint8Array): Frame {
  const reader = new ByteReader(body);
  const frame: Frame = {
    topologyHash: reader.u64Exact(), tick: reader.u64(), simTimeS: reader.f64(), snapshotSequence: reader.u64(),
    baseTick: reader.u64(), overruns: reader.u64(), publishNs: reader.u64(), maxDisplacementMm: 0, stepFlags: 0,
    full: false, pointCount: 0, movedVertices: 0, needles: [], ranges: new Uint32Array(), positions: new Float32Array(),
    seeds: null, certificate: null,
  };
  reader.skip(24);  // which pose the tick used
  frame.maxDisplacementMm = reader.f64();
  frame.stepFlags = reader.u32();
  frame.full = (reader.u32() & 1) !== 0;
  frame.pointCount = reader.u32();
  frame.movedVertices = reader.u32();
  const needleCount = reader.u16();
  reader.u16();
  reader.fits(needleCount, NEEDLE_BYTES);
  for (let i = 0; i < needleCount; ++i) frame.needles.push(readNeedle(reader));
  const rangeCount = reader.u32();
  reader.fits(rangeCount, 8);
  frame.ranges = reader.u32Array(2 * rangeCount);
  const points = checkRanges(frame);
  reader.fits(points, 12);
  frame.positions = reader.f32Array(3 * points);
  reader.sections((id, section) => {
    if (id === 1) readForces(section, frame.needles);
    else if (id === 2) frame.seeds = readSeeds(section);
    else if (id === 3) frame.certificate = readCertificate(section);
    else if (id === 7) readShapes(section, frame.needles);
    else return false;
    return true;
  });
  reader.finish();
  if (frame.baseTick > frame.tick) throw new ProtocolError("a frame's base tick is later than its tick");
  return frame;
}
