// Samples for the charts over time in seconds, kept for the length of the longest chart.

const KEEP_S = 120;

/** Columns of numbers that grow together, sorted by the first, which is the time. */
export class Series {
  readonly columns: number[][];

  constructor(width: number) {
    this.columns = Array.from({length: width}, () => []);
  }

  get length(): number {
    return this.columns[0]!.length;
  }

  push(...row: number[]): void {
    this.columns.forEach((column, i) => column.push(row[i]!));
  }

  /** Index of the first sample later than `time`. */
  after(time: number): number {
    const times = this.columns[0]!;
    let low = 0;
    let high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle]! <= time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The samples in (from, to]. */
  slice(from: number, to: number): number[][] {
    const first = this.after(from);
    const end = this.after(to);
    return this.columns.map((column) => column.slice(first, end));
  }

  forget(before: number): void {
    const first = this.after(before);
    if (2 * first > this.length) this.columns.forEach((column) => column.splice(0, first));
  }

  clear(): void {
    this.columns.forEach((column) => (column.length = 0));
  }
}

export class History {
  /** Per needle: time, depth in the tissue mm (0: outside), axial N, lateral N, z of the tip mm. */
  private readonly needles = new Map<number, Series>();
  /** Time, least det J at the points, certified bound. */
  readonly det = new Series(3);
  /** Time, p50 and p99 of a tick's computation, ms. */
  readonly ticks = new Series(3);
  /** Time of the newest sample, or the playback position of a recording. */
  nowS = 0;

  needle(id: number): Series {
    let series = this.needles.get(id);
    if (!series) this.needles.set(id, (series = new Series(5)));
    return series;
  }

  private all(): Series[] {
    return [...this.needles.values(), this.det, this.ticks];
  }

  forgetOld(): void {
    this.all().forEach((series) => series.forget(this.nowS - KEEP_S));
  }

  clear(): void {
    this.all().forEach((series) => series.clear());
    this.nowS = 0;
  }
}
