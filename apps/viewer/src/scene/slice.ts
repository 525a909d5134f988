// The material section at the clipping plane, with the displacement on it. Its vertices lie on a grid in the plane at rest and
// are carried by the points around them, with weights computed when the plane is moved, not in each snapshot.
import {BufferAttribute, BufferGeometry, Mesh} from 'three';
import type {MeshBuffer} from './mesh_buffer.js';
import {linearWeights} from './interpolation.js';
import {PointGrid} from './point_grid.js';
import {outline, signedDistance} from './outline.js';
import {tissueMaterial, type TissueUniforms} from './tissue_material.js';

const SIDE = 64;
const NEIGHBOURS = 16;
const FAR_OUTSIDE_MM = 3;
export const SLICE_VERTICES = SIDE * SIDE;

export type Axis = 0 | 1 | 2;

export class Slice {
  readonly mesh: Mesh;
  private readonly rest = new BufferAttribute(new Float32Array(3 * SLICE_VERTICES), 3);
  private readonly outside = new BufferAttribute(new Float32Array(SLICE_VERTICES), 1);
  private readonly points = new Uint32Array(SLICE_VERTICES * NEIGHBOURS);
  private readonly weights = new Float32Array(SLICE_VERTICES * NEIGHBOURS);
  private readonly offsets = new Float64Array(3 * NEIGHBOURS);
  private buffer: MeshBuffer | null = null;
  private grid: PointGrid | null = null;
  private low = [0, 0, 0];
  private high = [0, 0, 0];

  constructor(uniforms: TissueUniforms) {
    this.mesh = new Mesh(new BufferGeometry(), tissueMaterial('SLICE', {...uniforms, mode: {value: 1}}, [0, 0, 0], 1));
    this.mesh.geometry.setIndex(gridIndex());
    this.mesh.geometry.setAttribute('rest', this.rest);
    this.mesh.geometry.setAttribute('extra', this.outside);
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  build(buffer: MeshBuffer): void {
    this.buffer = buffer;
    this.grid = null;
    const rest = buffer.topology.restPositions;
    this.low = [0, 1, 2].map((axis) => minimum(rest, axis, 3 * buffer.topology.surfaceVertexCount));
    this.high = [0, 1, 2].map((axis) => -minimum(rest.map((value) => -value), axis, 3 * buffer.topology.surfaceVertexCount));
    this.mesh.geometry.setAttribute('position', buffer.sliceAttribute);
    this.mesh.geometry.boundingSphere = buffer.bounds;
  }

  get box(): {low: number[]; high: number[]} {
    return {low: this.low, high: this.high};
  }

  /** The plane x, y or z = `offset` at rest. */
  place(axis: Axis, offset: number): void {
    const buffer = this.buffer;
    if (!buffer) return;
    this.grid ??= new PointGrid(buffer.topology.restPositions);
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3] as [Axis, Axis];
    const contour = outline(buffer.topology, axis, offset);
    const rest = this.rest.array as Float32Array;
    const outside = this.outside.array as Float32Array;
    const margin = 1;
    for (let i = 0; i < SLICE_VERTICES; ++i) {
      const place = [0, 0, 0];
      place[axis] = offset;
      place[u] = this.low[u]! - margin + ((this.high[u]! - this.low[u]! + 2 * margin) * (i % SIDE)) / (SIDE - 1);
      place[v] = this.low[v]! - margin + ((this.high[v]! - this.low[v]! + 2 * margin) * Math.floor(i / SIDE)) / (SIDE - 1);
      rest.set(place, 3 * i);
      outside[i] = signedDistance(contour, place[u]!, place[v]!);
      this.weigh(i, place);
    }
    this.rest.needsUpdate = true;
    this.outside.needsUpdate = true;
  }

  private weigh(vertex: number, place: number[]): void {
    const first = vertex * NEIGHBOURS;
    this.weights.fill(0, first, first + NEIGHBOURS);
    if ((this.outside.array as Float32Array)[vertex]! > FAR_OUTSIDE_MM) return;  // not visible: stays at rest
    const near = this.grid!.nearest(place[0]!, place[1]!, place[2]!, NEIGHBOURS);
    if (near.length === 0) return;
    near.forEach(({point}, n) => {
      this.points[first + n] = point;
      for (let axis = 0; axis < 3; ++axis) this.offsets[3 * n + axis] = this.restPoint(point, axis) - place[axis]!;
    });
    linearWeights(this.offsets, near.length, 1.05 * Math.sqrt(near.at(-1)!.d2) + 1e-6, this.weights, first);
  }

  private restPoint(point: number, axis: number): number {
    return this.buffer!.topology.restPositions[3 * point + axis]!;
  }

  /** Moves the vertices with the current points and writes them to the mesh's buffer. */
  update(): void {
    const buffer = this.buffer!;
    const restPoints = buffer.topology.restPositions;
    const now = buffer.positions;
    const rest = this.rest.array as Float32Array;
    for (let i = 0; i < SLICE_VERTICES; ++i)
      for (let axis = 0; axis < 3; ++axis) {
        let moved = 0;
        for (let n = i * NEIGHBOURS; n < (i + 1) * NEIGHBOURS; ++n) {
          const at = 3 * this.points[n]! + axis;
          moved += this.weights[n]! * (now[at]! - restPoints[at]!);
        }
        buffer.slice[3 * i + axis] = rest[3 * i + axis]! + moved;
      }
  }
}

function minimum(points: Float32Array, axis: number, end: number): number {
  let least = Infinity;
  for (let i = axis; i < end; i += 3) least = Math.min(least, points[i]!);
  return least;
}

function gridIndex(): number[] {
  const index: number[] = [];
  for (let row = 0; row + 1 < SIDE; ++row)
    for (let column = 0; column + 1 < SIDE; ++column) {
      const a = row * SIDE + column;
      index.push(a, a + 1, a + SIDE, a + 1, a + SIDE + 1, a + SIDE);
    }
  return index;
}
