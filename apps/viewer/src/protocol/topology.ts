// TOPOLOGY: the points at rest and the surface's triangles.
import {ByteReader, ProtocolError} from './bytes.js';

export interface Topology {
  hash: bigint;
  surfaceVertexCount: number;
  pointCount: number;
  /** 3T vertex indices. */
  triangles: Uint32Array;
  /** 3N, mm, frame W. */
  restPositions: Float32Array;
  name: string;
  /** Whether `hash` is that of the content. */
  hashHolds: boolean;
}

export function decodeTopology(body: Uint8Array): Topology {
  const reader = new ByteReader(body);
  const hash = reader.u64Exact();
  const surfaceVertexCount = reader.u32();
  const pointCount = reader.u32();
  const triangleCount = reader.u32();
  reader.u32();
  reader.fits(triangleCount, 12);
  const triangles = reader.u32Array(3 * triangleCount);
  reader.fits(pointCount, 12);
  const restPositions = reader.f32Array(3 * pointCount);
  if (surfaceVertexCount > pointCount) throw new ProtocolError('a topology has more surface vertices than points');
  for (const vertex of triangles)
    if (vertex >= surfaceVertexCount) throw new ProtocolError('a triangle names a vertex that is not there');
  const hashed = body.subarray(8, 24 + 12 * triangleCount + 12 * pointCount);
  const name = reader.text();
  reader.sections(() => false);
  reader.finish();
  return {hash, surfaceVertexCount, pointCount, triangles, restPositions, name, hashHolds: fnv1a64(hashed) === hash};
}

/** 64-bit FNV-1a. The product with the prime 2^40 + 0x1b3 in 32-bit halves: a BigInt per byte takes a hundred times as long. */
export function fnv1a64(bytes: Uint8Array): bigint {
  let high = 0xcbf29ce4;
  let low = 0x84222325;
  for (let i = 0; i < bytes.length; ++i) {
    low = (low ^ bytes[i]!) >>> 0;
    const product = low * 0x1b3;
    const carried = (product - (product % 4294967296)) / 4294967296;
    high = (Math.imul(high, 0x1b3) + carried + (low << 8)) >>> 0;
    low = product >>> 0;
  }
  return (BigInt(high) << 32n) | BigInt(low);
}
