// Interpolation weights of the points around a location: moving least squares with linear polynomials, which reproduce
// every affine field exactly (Lancaster and Salkauskas 1981).

/** Point n is at `offsets[3n …]` from the location, all within `radius`. Writes `weights`, which sum to 1. */
export function linearWeights(offsets: Float64Array, count: number, radius: number, weights: Float32Array, at: number): void {
  const moments = new Float64Array(20);  // 4 × 5: Σ θ p pᵀ | e₁, lengths in radii
  moments[4] = 1;
  const p = [1, 0, 0, 0];
  const load = (n: number): number => {
    let square = 0;
    for (let axis = 0; axis < 3; ++axis) {
      p[axis + 1] = offsets[3 * n + axis]! / radius;
      square += p[axis + 1]! ** 2;
    }
    return Math.max(0, 1 - Math.sqrt(square)) ** 2 + 1e-9;
  };
  for (let n = 0; n < count; ++n) {
    const theta = load(n);
    for (let row = 0; row < 4; ++row)
      for (let column = 0; column < 4; ++column) moments[5 * row + column]! += theta * p[row]! * p[column]!;
  }
  const a = solve4(moments);
  for (let n = 0; n < count; ++n) {
    const theta = load(n);
    weights[at + n] = theta * (a[0]! + a[1]! * p[1]! + a[2]! * p[2]! + a[3]! * p[3]!);
  }
}

/** Gaussian elimination with pivots; a direction without spread of the points is ignored. */
function solve4(m: Float64Array): number[] {
  const used: boolean[] = [false, false, false, false];
  const pivots = [-1, -1, -1, -1];
  for (let column = 0; column < 4; ++column) {
    let pivot = -1;
    for (let row = 0; row < 4; ++row)
      if (!used[row] && (pivot < 0 || Math.abs(m[5 * row + column]!) > Math.abs(m[5 * pivot + column]!))) pivot = row;
    if (Math.abs(m[5 * pivot + column]!) < 1e-8) continue;
    used[pivot] = true;
    pivots[column] = pivot;
    for (let row = 0; row < 4; ++row) {
      if (row === pivot) continue;
      const factor = m[5 * row + column]! / m[5 * pivot + column]!;
      for (let i = column; i < 5; ++i) m[5 * row + i]! -= factor * m[5 * pivot + i]!;
    }
  }
  return pivots.map((pivot, column) => (pivot < 0 ? 0 : m[5 * pivot + 4]! / m[5 * pivot + column]!));
}
