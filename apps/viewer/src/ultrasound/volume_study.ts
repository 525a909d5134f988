// A volume study: the gland's outlines on frozen images, a closed curve through points for each slice, with undo.
import type {Vec3} from '../protocol/bytes.js';
import type {ContourSlice} from '../protocol/contour.js';
import type {UltrasoundImage} from '../protocol/image.js';
import {toPixel, toWorld, type Pixel} from './geometry.js';

const SAME_PLANE_MM = 0.5;
const PARALLEL = 0.999;
const PIECES = 8;  // of the curve between two points
const MOST_UNDONE = 200;
const FREEHAND_MM = 3;  // between points of a drag
const WHOLE = 6;        // points of an outline that may be closed
const SPIKE_RAD = Math.PI / 3;
const SPIKE_MM = 8;

export interface StudySlice {
  number: number;
  tick: number;
  probeDepthMm: number;
  /** X_WI of the image that it was drawn on last. */
  pose: ArrayLike<number>;
  spacingMm: number;
  /** In the world, mm, in order around the gland. */
  points: Vec3[];
  selected: number;  // −1: none
}

/** The closed curve through points, by centripetal Catmull–Rom splines (P. J. Schneider; E. Catmull, R. Rom, 1974): it has no loops
 * between near points. Two points or fewer are left as they are. */
export function closedCurve(points: readonly Pixel[]): Pixel[] {
  const n = points.length;
  if (n < 3) return [...points];
  const curve: Pixel[] = [];
  const at = (i: number): Pixel => points[((i % n) + n) % n]!;
  const knot = (a: Pixel, b: Pixel): number => Math.max(1e-6, Math.sqrt(Math.hypot(b.x - a.x, b.y - a.y)));
  const mix = (a: Pixel, b: Pixel, from: number, to: number, t: number): Pixel => {
    const s = (t - from) / (to - from);
    return {x: a.x + s * (b.x - a.x), y: a.y + s * (b.y - a.y)};
  };
  for (let i = 0; i < n; ++i) {
    const [p0, p1, p2, p3] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
    const t1 = knot(p0, p1), t2 = t1 + knot(p1, p2), t3 = t2 + knot(p2, p3);
    for (let k = 0; k < PIECES; ++k) {
      const t = t1 + (k / PIECES) * (t2 - t1);
      const a1 = mix(p0, p1, 0, t1, t), a2 = mix(p1, p2, t1, t2, t), a3 = mix(p2, p3, t2, t3, t);
      curve.push(mix(mix(a1, a2, 0, t2, t), mix(a2, a3, t1, t3, t), t1, t2, t));
    }
  }
  return curve;
}

function distanceToSegment(p: Pixel, a: Pixel, b: Pixel): number {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const t = Math.max(0, Math.min(1, ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(p.x - a.x - t * dx, p.y - a.y - t * dy);
}

function isInPlane(image: UltrasoundImage, slice: StudySlice): boolean {
  const normal = (pose: ArrayLike<number>): Vec3 => [pose[2]!, pose[6]!, pose[10]!];
  const [a, b] = [normal(image.pose), normal(slice.pose)];
  const origin: Vec3 = [slice.pose[3]!, slice.pose[7]!, slice.pose[11]!];
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > PARALLEL && Math.abs(toPixel(image, origin).aside) < SAME_PLANE_MM;
}

/** Before which point of the outline one more belongs. */
function placeIn(points: readonly Pixel[], at: Pixel, reach: number): number {
  let into = points.length;
  if (points.length < 3) return into;
  const curve = closedCurve(points);
  let least = reach;
  curve.forEach((point, i) => {
    const distance = distanceToSegment(at, point, curve[(i + 1) % curve.length]!);
    if (distance <= least) [least, into] = [distance, Math.floor(i / PIECES) + 1];
  });
  if (least < reach) return into;
  const far = (a: Pixel, b: Pixel): number => Math.hypot(b.x - a.x, b.y - a.y);
  const longer = points.map((point, i) => {
    const next = points[(i + 1) % points.length]!;
    return far(point, at) + far(at, next) - far(point, next);
  });
  return longer.indexOf(Math.min(...longer)) + 1;
}

/** Whether a point there would stand out of an outline like a needle. */
function isSpike(points: readonly Pixel[], at: Pixel, spacingMm: number, reach: number): boolean {
  if (points.length < WHOLE || points.some((point) => Math.hypot(point.x - at.x, point.y - at.y) <= reach)) return false;
  const into = placeIn(points, at, reach);
  const gaps = points.map((point, i) => Math.hypot(points[(i + 1) % points.length]!.x - point.x, points[(i + 1) % points.length]!.y - point.y));
  const closing = gaps.pop()!;
  const usual = gaps.sort((one, other) => one - other)[gaps.length >> 1]!;
  if (into === points.length && closing > 2 * usual) return false;  // it is still being drawn
  const [a, b] = [points[into - 1]!, points[into % points.length]!];
  const [toA, toB] = [Math.hypot(a.x - at.x, a.y - at.y), Math.hypot(b.x - at.x, b.y - at.y)];
  const angle = Math.acos(Math.max(-1, Math.min(1, ((a.x - at.x) * (b.x - at.x) + (a.y - at.y) * (b.y - at.y)) / (toA * toB))));
  return angle < SPIKE_RAD && Math.min(toA, toB) * spacingMm > SPIKE_MM;
}

/** An outline as it is kept while the page is loaded again. */
type KeptSlice = Omit<StudySlice, 'pose'> & {pose: number[]};

export class VolumeStudy {
  slices: StudySlice[] = [];
  version = 0;
  private undone: {number: number; points: Vec3[]; selected: number}[] = [];
  private dragged: 'point' | 'freehand' | null = null;
  private nextNumber = 0;

  /** The outlines as text, for restore(). */
  kept(): string {
    return JSON.stringify(this.slices.map((slice): KeptSlice => ({...slice, pose: Array.from(slice.pose)})));
  }

  /** The outlines that kept() gave; does nothing where the text is none of its. */
  restore(text: string): void {
    try {
      const slices = JSON.parse(text) as KeptSlice[];
      if (!Array.isArray(slices) || !slices.every((slice) => slice.pose.length === 12 && slice.points.every((point) => point.length === 3))) return;
      this.slices = slices;
      this.nextNumber = Math.max(-1, ...slices.map(({number}) => number)) + 1;
      this.version += 1;
    } catch {
      // of an earlier page, or damaged
    }
  }

  clear(): void {
    this.slices = [];
    this.undone = [];
    this.version += 1;
  }

  /** The image's slice; null: nothing was drawn in its plane. */
  sliceOf(image: UltrasoundImage): StudySlice | null {
    return this.slices.find((slice) => isInPlane(image, slice)) ?? null;
  }

  /** Points of the image's outline, in pixels, and the selected one. */
  handles(image: UltrasoundImage): {points: Pixel[]; selected: number} {
    const slice = this.sliceOf(image);
    return {points: slice?.points.map((point) => toPixel(image, point)) ?? [], selected: slice?.selected ?? -1};
  }

  /** Takes the point within `reach` pixels; else inserts one into the curve where it passes within reach, or where it makes the way
   * around least longer. False: nothing was done, as the press is beside the image, or its point would be a spike. */
  press(image: UltrasoundImage, at: Pixel, reach: number, probeDepthMm: number): boolean {
    if (at.x < -0.5 || at.y < -0.5 || at.x > image.width - 0.5 || at.y > image.height - 0.5) return false;
    const before = this.sliceOf(image)?.points.map((point) => toPixel(image, point)) ?? [];
    if (isSpike(before, at, image.spacingMm, reach)) return false;
    const slice = this.edit(image, probeDepthMm);
    const points = slice.points.map((point) => toPixel(image, point));
    const near = points.findIndex((point) => Math.hypot(point.x - at.x, point.y - at.y) <= reach);
    this.dragged = 'point';
    if (near >= 0) {
      slice.selected = near;
      return true;
    }
    const into = placeIn(points, at, reach);
    slice.points.splice(into, 0, toWorld(image, at));
    slice.selected = into;
    if (into === slice.points.length - 1) this.dragged = 'freehand';
    return true;
  }

  /** Moves the selected point; from a press beside everything adds points along the way. */
  drag(image: UltrasoundImage, at: Pixel): void {
    const slice = this.sliceOf(image);
    if (!slice || !this.dragged || slice.selected < 0) return;
    const last = toPixel(image, slice.points[slice.selected]!);
    if (this.dragged === 'freehand') {
      if (Math.hypot(at.x - last.x, at.y - last.y) * image.spacingMm < FREEHAND_MM) return;
      slice.points.push(toWorld(image, at));
      slice.selected = slice.points.length - 1;
    } else {
      slice.points[slice.selected] = toWorld(image, at);
    }
    this.version += 1;
  }

  release(): void {
    this.dragged = null;
  }

  /** Moves the selected point by pixels. */
  nudge(image: UltrasoundImage, dx: number, dy: number, probeDepthMm: number): void {
    if ((this.sliceOf(image)?.selected ?? -1) < 0) return;
    const slice = this.edit(image, probeDepthMm);
    const {x, y} = toPixel(image, slice.points[slice.selected]!);
    slice.points[slice.selected] = toWorld(image, {x: x + dx, y: y + dy});
  }

  /** Adds a point by key: halfway to the next on the curve, the first ones about the image's middle. */
  insert(image: UltrasoundImage, probeDepthMm: number): void {
    const slice = this.edit(image, probeDepthMm);
    const points = slice.points.map((point) => toPixel(image, point));
    const into = slice.selected < 0 ? points.length : slice.selected + 1;
    const angle = points.length * (2 * Math.PI / 3);
    const place = points.length > 2 ? closedCurve(points)[(into - 1) * PIECES + PIECES / 2]!
      : {x: image.width / 2 + (10 / image.spacingMm) * Math.sin(angle), y: image.height / 2 - (10 / image.spacingMm) * Math.cos(angle)};
    slice.points.splice(into, 0, toWorld(image, place));
    slice.selected = into;
  }

  select(image: UltrasoundImage, by: number): void {
    const slice = this.sliceOf(image);
    if (!slice || slice.points.length === 0) return;
    slice.selected = (Math.max(0, slice.selected) + by + slice.points.length) % slice.points.length;
    this.version += 1;
  }

  /** Removes the selected point, or the last. */
  remove(image: UltrasoundImage, probeDepthMm: number): void {
    if (!this.sliceOf(image)) return;
    const slice = this.edit(image, probeDepthMm);
    slice.points.splice(slice.selected < 0 ? slice.points.length - 1 : slice.selected, 1);
    slice.selected = Math.min(slice.selected, slice.points.length - 1);
    this.dropEmpty();
  }

  /** Removes the image's outline. */
  discard(image: UltrasoundImage, probeDepthMm: number): void {
    if (!this.sliceOf(image)) return;
    const slice = this.edit(image, probeDepthMm);
    slice.points = [];
    slice.selected = -1;
    this.dropEmpty();
  }

  /** Takes back the last change of the image's slice. */
  undo(image: UltrasoundImage): void {
    const slice = this.sliceOf(image);
    const at = this.undone.findLastIndex((change) => (slice ? change.number === slice.number : true));
    if (at < 0) return;
    const [change] = this.undone.splice(at, 1);
    if (slice) Object.assign(slice, {points: change!.points, selected: change!.selected});
    else this.bringBack(image, change!);
    this.dropEmpty();
    this.version += 1;
  }

  /** Outlines that enclose something, for CONTOUR: the curves, in mm on each image's plane. */
  outlines(): ContourSlice[] {
    return this.slices.filter(({points}) => points.length > 2).map(({number, tick, probeDepthMm, pose, spacingMm, points}) => {
      const plane = {pose, spacingMm} as UltrasoundImage;
      const curve = closedCurve(points.map((point) => toPixel(plane, point)));
      return {slice: number, tick, probeDepthMm, pose, points: curve.map(({x, y}) => [x * spacingMm, y * spacingMm] as [number, number])};
    });
  }

  /** The slice to change, as drawn on this image from now on. */
  private edit(image: UltrasoundImage, probeDepthMm: number): StudySlice {
    this.version += 1;
    let slice = this.sliceOf(image);
    if (!slice) {
      slice = {number: this.nextNumber++, tick: image.tick, probeDepthMm, pose: image.pose, spacingMm: image.spacingMm, points: [], selected: -1};
      this.slices.push(slice);
    } else {
      // Into this image's plane, which may be some tenths of a millimetre beside that of the last.
      slice.points = slice.points.map((point) => toWorld(image, toPixel(image, point)));
      Object.assign(slice, {tick: image.tick, probeDepthMm, pose: image.pose, spacingMm: image.spacingMm});
    }
    this.undone.push({number: slice.number, points: [...slice.points], selected: slice.selected});
    if (this.undone.length > MOST_UNDONE) this.undone.shift();
    return slice;
  }

  /** A slice that is gone comes back where its points lie in the image's plane. */
  private bringBack(image: UltrasoundImage, change: {number: number; points: Vec3[]; selected: number}): void {
    const [first] = change.points;
    if (!first || Math.abs(toPixel(image, first).aside) > SAME_PLANE_MM) return void this.undone.push(change);
    this.slices.push({number: change.number, tick: image.tick, probeDepthMm: NaN, pose: image.pose, spacingMm: image.spacingMm, points: change.points, selected: change.selected});
  }

  private dropEmpty(): void {
    this.slices = this.slices.filter(({points}) => points.length > 0);
  }
}
