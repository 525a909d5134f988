// Nearest points of a location, found with a grid of cells.

export class PointGrid {
  private readonly cells = new Map<number, number[]>();
  private readonly cell: number;
  private readonly low: [number, number, number] = [Infinity, Infinity, Infinity];

  /** `points`: 3N. */
  constructor(private readonly points: Float32Array) {
    const high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < points.length; ++i) {
      const axis = i % 3;
      this.low[axis] = Math.min(this.low[axis]!, points[i]!);
      high[axis] = Math.max(high[axis]!, points[i]!);
    }
    const volume = high.reduce((product, h, axis) => product * Math.max(h - this.low[axis]!, 1e-3), 1);
    this.cell = Math.cbrt((volume / Math.max(points.length / 3, 1)) * 4);
    for (let i = 0; i < points.length / 3; ++i) {
      const key = this.key(this.index(points[3 * i]!, 0), this.index(points[3 * i + 1]!, 1), this.index(points[3 * i + 2]!, 2));
      const members = this.cells.get(key);
      if (members) members.push(i);
      else this.cells.set(key, [i]);
    }
  }

  private index(value: number, axis: 0 | 1 | 2): number {
    return Math.floor((value - this.low[axis]) / this.cell) + 64;
  }

  private key(x: number, y: number, z: number): number {
    return (x * 4096 + y) * 4096 + z;
  }

  /** The `count` nearest points, as far as four cells hold that many; nearest first, with their squared distances. */
  nearest(x: number, y: number, z: number, count: number): {point: number; d2: number}[] {
    const [cx, cy, cz] = [this.index(x, 0), this.index(y, 1), this.index(z, 2)];
    for (let reach = 1; ; ++reach) {
      const found: {point: number; d2: number}[] = [];
      for (let i = cx - reach; i <= cx + reach; ++i)
        for (let j = cy - reach; j <= cy + reach; ++j)
          for (let k = cz - reach; k <= cz + reach; ++k) this.insert(this.cells.get(this.key(i, j, k)), x, y, z, count, found);
      const beyond = (reach * this.cell) ** 2;  // points not yet visited are at least this far away
      if ((found.length === count && found[count - 1]!.d2 <= beyond) || reach === 4) return found;
    }
  }

  /** Keeps `found` sorted and of at most `count`. */
  private insert(members: number[] | undefined, x: number, y: number, z: number, count: number, found: {point: number; d2: number}[]): void {
    if (!members) return;
    for (const point of members) {
      const dx = this.points[3 * point]! - x, dy = this.points[3 * point + 1]! - y, dz = this.points[3 * point + 2]! - z;
      const d2 = dx * dx + dy * dy + dz * dz;
      let at = found.length;
      if (at === count && d2 >= found[at - 1]!.d2) continue;
      while (at > 0 && found[at - 1]!.d2 > d2) --at;
      found.splice(at, 0, {point, d2});
      if (found.length > count) found.pop();
    }
  }
}
