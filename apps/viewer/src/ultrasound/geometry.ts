// Between the world and an image's pixels (column, row; the middle of the first is 0, 0).
import type {Vec3} from '../protocol/bytes.js';
import type {UltrasoundImage} from '../protocol/image.js';
import type {TemplateGrid} from '../protocol/scene_message.js';

export interface Pixel {
  x: number;
  y: number;
}

/** What is drawn over an image. */
export interface Outline {
  points: readonly Pixel[];
  selected: number;
  curve: readonly Pixel[];
  truth: readonly (readonly Pixel[])[];
}

const axis = (image: UltrasoundImage, column: number): Vec3 => [image.pose[column]!, image.pose[4 + column]!, image.pose[8 + column]!];
const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Where a place in the world is in the image, and how far in front of its plane, mm. */
export function toPixel(image: UltrasoundImage, place: Vec3): Pixel & {aside: number} {
  const p: Vec3 = [place[0] - image.pose[3]!, place[1] - image.pose[7]!, place[2] - image.pose[11]!];
  return {x: dot(p, axis(image, 0)) / image.spacingMm, y: dot(p, axis(image, 1)) / image.spacingMm, aside: dot(p, axis(image, 2))};
}

export function toWorld(image: UltrasoundImage, {x, y}: Pixel): Vec3 {
  const [i, j] = [axis(image, 0), axis(image, 1)];
  const at = (k: 0 | 1 | 2): number => image.pose[4 * k + 3]! + image.spacingMm * (x * i[k] + y * j[k]);
  return [at(0), at(1), at(2)];
}

export const distanceMm = (image: UltrasoundImage, a: Pixel, b: Pixel): number => image.spacingMm * Math.hypot(a.x - b.x, a.y - b.y);

/** What a hole's needle, straight along +z, is in the image: a point where it crosses the plane, or the row that it runs along in the
 * plane where it lies within half a hole's spacing of it. */
export type HoleMark = {column: number; row: number} & ({kind: 'point'; at: Pixel} | {kind: 'line'; from: Pixel; to: Pixel});

export function templateMarks(image: UltrasoundImage, template: TemplateGrid): HoleMark[] {
  const along: Vec3 = [0, 0, 1];
  const slope = dot(along, axis(image, 2));  // 1: the plane is across the needles
  const marks: HoleMark[] = [];
  for (let column = 0; column < template.columns; ++column)
    for (let row = 0; row < template.rows; ++row) {
      const hole: Vec3 = [template.origin[0] + column * template.spacingMm, template.origin[1] + row * template.spacingMm, template.origin[2]];
      const start = toPixel(image, hole);
      if (Math.abs(slope) > 0.2) {
        const z = -start.aside / slope;
        marks.push({kind: 'point', column, row, at: toPixel(image, [hole[0], hole[1], hole[2] + z])});
        continue;
      }
      const end = toPixel(image, [hole[0], hole[1], hole[2] + 1]);
      const [dx, dy] = [end.x - start.x, end.y - start.y];
      // Where the needle is at the image's middle.
      const reach = ((image.width / 2 - start.x) * dx + (image.height / 2 - start.y) * dy) / (dx * dx + dy * dy);
      if (Math.abs(start.aside + reach * slope) > template.spacingMm / 2) continue;
      const far = (image.width + image.height) / Math.hypot(dx, dy);
      const at = (z: number): Pixel => ({x: start.x + z * dx, y: start.y + z * dy});
      marks.push({kind: 'line', column, row, from: at(reach - far), to: at(reach + far)});
    }
  return marks;
}
