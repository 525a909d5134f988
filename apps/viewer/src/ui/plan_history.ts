// Changes of the plan that can be taken back, and made again: of this page's requests, as the daemon has done them.
import type {PlanNeedle} from '../protocol/plan_message.js';

const MOST = 100;

export class PlanHistory {
  /** What was left of the plan before each change, the newest last. */
  readonly undo: PlanNeedle[][] = [];
  readonly redo: PlanNeedle[][] = [];
  private change = -1;
  private done: (() => void) | null = null;

  /** A change of `rest` was requested. */
  asked(rest: PlanNeedle[]): void {
    this.done = () => {
      this.undo.push(rest);
      if (this.undo.length > MOST) this.undo.shift();
      this.redo.length = 0;
    };
  }

  /** The last of `from`, which is one of the two lists, was requested again instead of `rest`. */
  stepped(from: PlanNeedle[][], rest: PlanNeedle[]): void {
    const to = from === this.undo ? this.redo : this.undo;
    this.done = () => {
      from.pop();
      to.push(rest);
    };
  }

  refused(): void {
    this.done = null;
  }

  /** The plan in use is this change. One that this page has not asked for leaves nothing to take back. */
  update(change: number): void {
    if (change === this.change) return;
    const isNext = change === this.change + 1;
    this.change = change;
    if (this.done && isNext) this.done();
    else this.undo.length = this.redo.length = 0;
    this.done = null;
  }
}
