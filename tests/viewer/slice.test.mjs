// What the clipping plane's section rests on: weights, neighbours, outline.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {viewer} from './viewer_module.mjs';

/** Numbers in [0, 1) that are the same each time. */
function* numbers(seed) {
  for (let state = seed; ; ) {
    state = (1103515245 * state + 12345) % 2147483648;
    yield state / 2147483648;
  }
}
const points = (count, seed) => {
  const random = numbers(seed);
  return Float32Array.from({length: 3 * count}, () => 20 * random.next().value - 10);
};

test('weights give an affine field back exactly, and add up to one', () => {
  const field = (x, y, z) => 3 - 0.4 * x + 1.7 * y + 0.2 * z;
  for (let seed = 1; seed <= 20; ++seed) {
    const offsets = Float64Array.from(points(16, seed), (value) => value / 10);
    const weights = new Float32Array(16);
    viewer.linearWeights(offsets, 16, 2, weights, 0);
    let sum = 0;
    let value = 0;
    weights.forEach((weight, n) => {
      sum += weight;
      value += weight * field(offsets[3 * n], offsets[3 * n + 1], offsets[3 * n + 2]);
    });
    assert.ok(Math.abs(sum - 1) < 1e-5, `sum ${sum}`);
    assert.ok(Math.abs(value - field(0, 0, 0)) < 1e-4, `value ${value}`);
  }
});

test('points in a plane, and one point alone, still give weights', () => {
  const flat = Float64Array.from([1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -1, 0]);
  const weights = new Float32Array(4);
  viewer.linearWeights(flat, 4, 1.1, weights, 0);
  weights.forEach((weight) => assert.ok(Math.abs(weight - 0.25) < 1e-5));
  viewer.linearWeights(Float64Array.of(0.5, 0, 0), 1, 1, weights, 0);
  assert.ok(Math.abs(weights[0] - 1) < 1e-5);
});

test('the nearest points are those that a search through all finds', () => {
  const all = points(3000, 7);
  const grid = new viewer.PointGrid(all);
  for (const place of [[0, 0, 0], [3.3, -7, 9], [-9.9, 9.9, 0.1]]) {
    const found = grid.nearest(...place, 8).map(({point}) => point);
    const d2 = (n) => place.reduce((sum, value, axis) => sum + (all[3 * n + axis] - value) ** 2, 0);
    const sorted = Array.from({length: 3000}, (_, n) => n).sort((a, b) => d2(a) - d2(b)).slice(0, 8);
    assert.deepEqual(found, sorted);
  }
});

test("a cube's outline tells in from out, and how far", () => {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [10 * (i & 1), 10 * ((i >> 1) & 1), 10 * (i >> 2)]);
  const quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  const triangles = Uint32Array.from(quads.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]));
  const cube = {restPositions: Float32Array.from(corners), triangles};
  for (const axis of [0, 1, 2]) {
    const segments = viewer.outline(cube, axis, 4);
    for (const [u, v, expected] of [[5, 5, -5], [1, 5, -1], [12, 5, 2], [5, -3, 3], [13, 14, 5]])
      assert.ok(Math.abs(viewer.signedDistance(segments, u, v) - expected) < 1e-5, `axis ${axis}, ${u} ${v}`);
  }
  assert.ok(viewer.signedDistance(viewer.outline(cube, 0, 20), 5, 5) > 100);
});
