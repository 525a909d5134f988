// TOPOLOGY: the points at rest and the surface's triangles.
import {ByteReader, ProtocolError} from './bytes.js';
import {readTopology, type Topology as Wire} from './wire_generated.js';

/** `triangles`: 3T vertex indices; `restPositions`: 3N, mm, frame W. */
export interface Topology extends Wire {
  pointCount: number;
  /** Whether `hash` is that of the content. */
  hashHolds: boolean;
}

export function decodeTopology(body: Uint8Array): Topology {
  const topology = readTopology(new ByteReader(body));
  const {hash, surfaceVertexCount, triangles, restPositions} = topology;
  const pointCount = restPositions.length / 3;
  if (surfaceVertexCount > pointCount) throw new ProtocolError('a topology has more surface vertices than points');
  for (const vertex of triangles)
    if (vertex >= surfaceVertexCount) throw new ProtocolError('a triangle names a vertex that is not there');
  const hashed = body.subarray(8, 24 + triangles.byteLength + restPositions.byteLength);
  return {...topology, pointCount, hashHolds: fnv1a64(hashed) === hash};
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
