// Where a needle that is moved by hand is from one pose to the next: never faster than a hand, and through the tissue along itself only.

const FASTEST_MM_S = 120;  // in front of the tissue, and by the mouse: a jump of the mouse moves the needle at the speed of a hand
const WITHDRAW_MM_S = 40;  // out of the tissue, to another hole
const NEAR_MM = 0.01;

/** Rotation part of a pose with the shaft along +z. */
const STRAIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];

export class NeedleCourse {
  /** Target of the tip, and the position sent last; mm. */
  readonly target = [0, 0, 0];
  readonly tip = [0, 0, 0];
  private rotation = STRAIGHT;
  /** The way to another hole: back to z = `outside`, then across. */
  private change: {x: number; y: number; outside: number} | null = null;

  /** A needle that is nowhere yet starts here. */
  startAt(x: number, y: number, z: number): void {
    this.rotation = STRAIGHT;
    this.change = null;
    for (const place of [this.target, this.tip]) place.splice(0, 3, x, y, z);
  }

  /** A needle that is there, X_WN row by row, stays there. */
  startFrom(pose: ArrayLike<number>): void {
    this.startAt(pose[3]!, pose[7]!, pose[11]!);
    this.rotation = [0, 1, 2, 4, 5, 6, 8, 9, 10].map((at) => pose[at]!);
  }

  /** To another hole, whose needle is along +z; out of the tissue first. Does nothing where it is in that hole. */
  goTo(x: number, y: number, outside: number): void {
    const isThere = Math.hypot(x - this.tip[0]!, y - this.tip[1]!) < NEAR_MM && this.isStraight;
    this.change = isThere ? null : {x, y, outside};
    if (this.change) this.target.splice(0, 3, x, y, Math.min(this.tip[2]!, outside));
  }

  /** Ignored on the way to another hole. A needle that is aslant moves along itself only. */
  move(dx: number, dy: number, dz: number): void {
    if (this.change) return;
    const along = this.isStraight ? [0, 0, 1] : [this.rotation[2]!, this.rotation[5]!, this.rotation[8]!];
    const aside = this.isStraight ? [dx, dy] : [0, 0];
    for (let i = 0; i < 3; ++i) this.target[i]! += (aside[i] ?? 0) + dz * along[i]!;
  }

  /** Stays where it is. */
  stop(): void {
    if (!this.change) this.target.splice(0, 3, ...this.tip);
  }

  /** The pose `s` seconds later. */
  next(s: number): Float64Array {
    if (this.change) this.changeHole(this.change, s);
    else this.approach(this.target, FASTEST_MM_S * s);
    const r = this.rotation;
    return Float64Array.of(r[0]!, r[1]!, r[2]!, this.tip[0]!, r[3]!, r[4]!, r[5]!, this.tip[1]!, r[6]!, r[7]!, r[8]!, this.tip[2]!);
  }

  private get isStraight(): boolean {
    return this.rotation[8]! > 1 - 1e-9;
  }

  private changeHole(change: {x: number; y: number; outside: number}, s: number): void {
    const above = this.tip[2]! - change.outside;
    if (above > NEAR_MM) {
      const along = [this.rotation[2]!, this.rotation[5]!, this.rotation[8]!];
      const way = along[2]! > 0.1 ? above / along[2]! : above;
      return void this.approach(this.tip.map((value, i) => value - way * (along[2]! > 0.1 ? along[i]! : i === 2 ? 1 : 0)), WITHDRAW_MM_S * s);
    }
    this.rotation = STRAIGHT;
    if (this.approach([change.x, change.y, this.tip[2]!], FASTEST_MM_S * s)) {
      this.target.splice(0, 3, ...this.tip);
      this.change = null;
    }
  }

  /** Returns whether it is there. */
  private approach(place: readonly number[], farMm: number): boolean {
    const way = place.map((value, axis) => value - this.tip[axis]!);
    const length = Math.hypot(...way);
    const share = Math.min(1, farMm / (length || 1));
    way.forEach((value, axis) => (this.tip[axis]! += share * value));
    return length <= farMm;
  }
}
