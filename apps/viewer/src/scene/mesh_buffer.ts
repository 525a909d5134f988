// Everything that moves with the tissue, in one buffer of the graphics card, so that a snapshot is one upload:
// normals of the surface | points | slice of the clipping plane, three floats each.
import {DynamicDrawUsage, InterleavedBuffer, InterleavedBufferAttribute, Sphere, Vector3} from 'three';
import type {Topology} from '../protocol/topology.js';

export class MeshBuffer {
  readonly positions: Float32Array;
  readonly slice: Float32Array;
  readonly normals: Float32Array;
  readonly positionAttribute: InterleavedBufferAttribute;
  readonly normalAttribute: InterleavedBufferAttribute;
  readonly sliceAttribute: InterleavedBufferAttribute;
  /** Bounding sphere of the points at rest; also used for the deformed mesh. */
  readonly bounds: Sphere;
  /** The largest displacement of a point that has been uploaded, mm. */
  mostMm = 0;
  private readonly buffer: InterleavedBuffer;

  constructor(readonly topology: Topology, sliceVertices: number) {
    const surface = 3 * topology.surfaceVertexCount;
    const points = 3 * topology.pointCount;
    const all = new Float32Array(surface + points + 3 * sliceVertices);
    this.normals = all.subarray(0, surface);
    this.positions = all.subarray(surface, surface + points);
    this.slice = all.subarray(surface + points);
    this.bounds = boundsOf(topology.restPositions);
    this.buffer = new InterleavedBuffer(all, 3);
    this.buffer.setUsage(DynamicDrawUsage);
    this.normalAttribute = new InterleavedBufferAttribute(this.buffer, 3, 0);
    this.positionAttribute = new InterleavedBufferAttribute(this.buffer, 3, surface);
    this.sliceAttribute = new InterleavedBufferAttribute(this.buffer, 3, surface + points);
  }

  /** Uploads changed points up to `end`, and the slice if it is shown. Call once before drawing. */
  upload(first: number, end: number, withSlice: boolean): void {
    this.updateNormals();
    this.measure(first, end);
    const floats = withSlice ? this.buffer.array.length : this.normals.length + 3 * end;
    this.buffer.clearUpdateRanges();
    this.buffer.addUpdateRange(0, floats);
    this.buffer.needsUpdate = true;
  }

  private measure(first: number, end: number): void {
    const {positions: p} = this;
    const rest = this.topology.restPositions;
    let most = 0;
    for (let i = 3 * first; i < 3 * end; i += 3) {
      const x = p[i]! - rest[i]!, y = p[i + 1]! - rest[i + 1]!, z = p[i + 2]! - rest[i + 2]!;
      most = Math.max(most, x * x + y * y + z * z);
    }
    this.mostMm = Math.max(this.mostMm, Math.sqrt(most));
  }

  /** Normal of a vertex: the area-weighted sum of the normals of its triangles. */
  private updateNormals(): void {
    const {normals: n, positions: p} = this;
    const triangles = this.topology.triangles;
    n.fill(0);
    for (let t = 0; t < triangles.length; t += 3) {
      const a = 3 * triangles[t]!, b = 3 * triangles[t + 1]!, c = 3 * triangles[t + 2]!;
      const ux = p[b]! - p[a]!, uy = p[b + 1]! - p[a + 1]!, uz = p[b + 2]! - p[a + 2]!;
      const vx = p[c]! - p[a]!, vy = p[c + 1]! - p[a + 1]!, vz = p[c + 2]! - p[a + 2]!;
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      for (const v of [a, b, c]) {
        n[v]! += x;
        n[v + 1]! += y;
        n[v + 2]! += z;
      }
    }
  }
}

function boundsOf(points: Float32Array): Sphere {
  const low = new Vector3(Infinity, Infinity, Infinity);
  const high = low.clone().negate();
  const point = new Vector3();
  for (let i = 0; i < points.length; i += 3) {
    point.fromArray(points, i);
    low.min(point);
    high.max(point);
  }
  return new Sphere(low.add(high).multiplyScalar(0.5), low.distanceTo(high));
}
