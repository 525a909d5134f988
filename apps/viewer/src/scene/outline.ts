// The cut of a plane with the surface at rest, and the signed distance of a point in the plane from it.

/** Segments u0, v0, u1, v1 of the cut with x, y or z = offset; u and v are the axes that follow. */
export function outline(mesh: {restPositions: ArrayLike<number>; triangles: ArrayLike<number>}, axis: 0 | 1 | 2, offset: number): Float32Array {
  const {restPositions: p, triangles} = mesh;
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
  const segments: number[] = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const cut: number[] = [];
    for (let side = 0; side < 3; ++side) {
      const a = 3 * triangles[t + side]!;
      const b = 3 * triangles[t + ((side + 1) % 3)]!;
      const da = p[a + axis]! - offset;
      const db = p[b + axis]! - offset;
      if (da < 0 === db < 0) continue;
      const share = da / (da - db);
      cut.push(p[a + u]! + share * (p[b + u]! - p[a + u]!), p[a + v]! + share * (p[b + v]! - p[a + v]!));
    }
    if (cut.length === 4) segments.push(...cut);
  }
  return new Float32Array(segments);
}

/** < 0 inside; Infinity where the plane misses the surface. */
export function signedDistance(segments: Float32Array, u: number, v: number): number {
  let nearest = Infinity;
  let inside = false;
  for (let i = 0; i < segments.length; i += 4) {
    const u0 = segments[i]!, v0 = segments[i + 1]!, u1 = segments[i + 2]!, v1 = segments[i + 3]!;
    const du = u1 - u0, dv = v1 - v0;
    const share = Math.min(1, Math.max(0, ((u - u0) * du + (v - v0) * dv) / (du * du + dv * dv || 1)));
    nearest = Math.min(nearest, Math.hypot(u - u0 - share * du, v - v0 - share * dv));
    if (v0 > v !== v1 > v && u < u0 + ((v - v0) / dv) * du) inside = !inside;
  }
  return segments.length === 0 ? 1e3 : inside ? -nearest : nearest;
}
