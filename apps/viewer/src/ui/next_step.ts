// What the trainee does next, in one sentence, by the plan.
import type {Session} from '../model/session.js';

const NEAR_MM = 1;

export interface HandState {
  held: boolean;
  needle: number;
  /** The hole in which the needle is; '': none. */
  hole: string;
  /** Tip of the needle, mm; null: it is not there. */
  tip: readonly number[] | null;
}

/** '': there is no plan that says it. */
export function nextStep(session: Session, hand: HandState): string {
  const needles = session.scene?.plannedNeedles ?? [];
  if (needles.length === 0 || session.plannedSeeds().size === 0) return '';
  const fallen = new Set(session.assembler.seeds.map(({planned}) => planned));
  const left = new Map<number, number>();
  for (const [number, {needle}] of session.plannedSeeds()) if (!fallen.has(number)) left.set(needle, (left.get(needle) ?? 0) + 1);
  const holeOfNeedle = (needle: number): string => session.plan?.needles[needle]?.hole ?? needles[needle]?.hole ?? '';
  const target = [...left.keys()].find((needle) => holeOfNeedle(needle) === hand.hole);
  const next = [...left.keys()][0];
  const depth = hand.tip && session.depthBeyondTemplate(hand.tip);
  if (next === undefined) return hand.held && depth !== null && depth > NEAR_MM ? 'All planned seeds have fallen: draw the needle out, then ask for your result.' : 'All planned seeds have fallen: ask for your result.';
  if (!hand.held) return 'Take the needle.';
  if (target === undefined) return hand.hole ? `No seed of the plan is left for ${hand.hole}: draw the needle out and choose ${holeOfNeedle(next)}.` : `Choose a hole: the plan begins with ${holeOfNeedle(next)}.`;
  const count = left.get(target)!;
  const seeds = count === 1 ? 'one seed' : `${count} seeds`;
  const planned = session.plan?.needles[target];
  const tipZ = planned ? planned.depthMm : session.depthBeyondTemplate(needles[target]!.tip);
  const isBegun = [...session.plannedSeeds()].some(([number, seed]) => seed.needle === target && fallen.has(number));
  if (isBegun) return `Go on with “Drop seed”: ${seeds} to go in ${hand.hole}.`;
  if (depth === null || tipZ === null) return `Advance in ${hand.hole}.`;
  if (depth < tipZ - NEAR_MM) return `Advance in ${hand.hole} to ${tipZ.toFixed(1)} mm beyond the template.`;
  if (depth > tipZ + NEAR_MM) return `Draw back in ${hand.hole} to ${tipZ.toFixed(1)} mm beyond the template.`;
  return `Press “Drop seed”: ${seeds} for ${hand.hole}.`;
}
