// CONTOUR: a volume study's outlines to the daemon, and its score.
import {ByteReader, ByteWriter} from './bytes.js';

const SLICE_BYTES = 120, POINT_BYTES = 16, PLANE_BYTES = 48;
const SCORE = 1;
export const MISSED = -1;

/** Of a request an operator's outline, of an answer the gland's own. */
export interface ContourSlice {
  slice: number;
  tick: number;
  probeDepthMm: number;
  /** X_WI of the image. */
  pose: ArrayLike<number>;
  /** mm in the plane. */
  points: [number, number][];
}

export interface PlaneScore {
  slice: number;  // MISSED: not outlined
  offsetMm: number;
  outlinedMm2: number;
  trueMm2: number;
  dice: number;
  hausdorffMm: number;
}

export interface ContourScore {
  dice: number;
  outlinedCm3: number;
  trueCm3: number;
  samePlanesCm3: number;
  volumeErrorPercent: number;
  hausdorffMm: number;
  hausdorff95Mm: number;
  meanMm: number;
  stepMm: number;
  missed: number;
  beyond: number;
  planes: PlaneScore[];
}

export interface Contour {
  aboutSequence: number;
  slices: ContourSlice[];
  score: ContourScore | null;
}

export function encodeContour(slices: readonly ContourSlice[]): Uint8Array {
  const writer = new ByteWriter();
  writer.u64(0n);
  writer.u16(slices.length);
  writer.u16(0);
  for (const slice of slices) {
    writer.u32(slice.slice);
    writer.u32(slice.points.length);
    writer.u64(BigInt(slice.tick));
    writer.f64(slice.probeDepthMm);
    for (let i = 0; i < 12; ++i) writer.f64(slice.pose[i]!);
    for (const [x, y] of slice.points) {
      writer.f64(x);
      writer.f64(y);
    }
  }
  writer.u32(0);  // no sections
  return writer.result();
}

export function decodeContour(body: Uint8Array): Contour {
  const reader = new ByteReader(body);
  const contour: Contour = {aboutSequence: reader.u64(), slices: [], score: null};
  const count = reader.u16();
  reader.u16();
  for (let left = reader.fits(count, SLICE_BYTES); left > 0; --left) {
    const slice = reader.i32();
    const points = reader.u32();
    const outline: ContourSlice = {slice, tick: reader.u64(), probeDepthMm: reader.f64(), pose: reader.pose(), points: []};
    for (let i = reader.fits(points, POINT_BYTES); i > 0; --i) outline.points.push([reader.f64(), reader.f64()]);
    contour.slices.push(outline);
  }
  reader.sections((id, section) => {
    if (id !== SCORE) return false;
    const score: ContourScore = {
      dice: section.f64(), outlinedCm3: section.f64(), trueCm3: section.f64(), samePlanesCm3: section.f64(), volumeErrorPercent: section.f64(),
      hausdorffMm: section.f64(), hausdorff95Mm: section.f64(), meanMm: section.f64(), stepMm: section.f64(),
      missed: section.u16(), beyond: section.u16(), planes: [],
    };
    const planes = section.u16();
    section.u16();
    for (let i = section.fits(planes, PLANE_BYTES); i > 0; --i) {
      const plane = section.i32();
      section.u32();
      score.planes.push({slice: plane, offsetMm: section.f64(), outlinedMm2: section.f64(), trueMm2: section.f64(), dice: section.f64(), hausdorffMm: section.f64()});
    }
    contour.score = score;
    return true;
  });
  reader.finish();
  return contour;
}
