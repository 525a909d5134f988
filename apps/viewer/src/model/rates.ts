// Rates over the last seconds and quantiles of the last samples.

/** Sums over a sliding window of 2 s. */
export class Rate {
  private readonly samples: {atMs: number; amount: number}[] = [];

  add(atMs: number, amount = 1): void {
    this.samples.push({atMs, amount});
    this.trim(atMs);
  }

  perSecond(nowMs: number): number {
    this.trim(nowMs);
    return this.samples.reduce((sum, sample) => sum + sample.amount, 0) / 2;
  }

  private trim(nowMs: number): void {
    while (this.samples.length > 0 && this.samples[0]!.atMs < nowMs - 2000) this.samples.shift();
  }
}

/** Quantiles of the last 300 samples. */
export class Recent {
  private readonly values: number[] = [];

  add(value: number): void {
    this.values.push(value);
    if (this.values.length > 300) this.values.shift();
  }

  quantile(q: number): number {
    if (this.values.length === 0) return NaN;
    const sorted = [...this.values].sort((a, b) => a - b);
    return sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))]!;
  }
}
