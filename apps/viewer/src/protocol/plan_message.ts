// PLAN: the plan in use, and an operator's request to change what is left of it.
import {ByteReader, encoded, type Vec3} from './bytes.js';
import {holeOf, shownHole, type PlannedSeed, type TemplateGrid} from './scene_message.js';
import {PlanFlag, PlanKind, PlanNeedleFlag, readPlan, writePlan} from './wire_generated.js';
import type {Plan as WirePlan, PlanNeedle as WireNeedle} from './wire_generated.js';

export {PlanKind} from './wire_generated.js';

/** A train's elements from the tip backwards, mm. */
export const SEED_MM = 4.5;
export const SPACER_MM = 5.5;

/** In a request a `depthMm` of NaN and an empty `train` are chosen by the loading rule. */
export interface PlanNeedle extends Omit<WireNeedle, 'flags'> {
  /** A seed has left it: it stays as it is. */
  begun: boolean;
}

/** `change`: the changes since the scene's file. */
export interface Plan extends Omit<WirePlan, 'flags' | 'needles'> {
  optimising: boolean;
  needles: PlanNeedle[];
}

export function decodePlan(body: Uint8Array): Plan {
  const {flags, needles, ...plan} = readPlan(new ByteReader(body));
  return {...plan, optimising: (flags & PlanFlag.Optimising) !== 0,
          needles: needles.map(({flags: bits, ...needle}) => ({...needle, begun: (bits & PlanNeedleFlag.Begun) !== 0}))};
}

/** `change`: of the plan that the request goes on from; `needles`: the rest as drawn, null: to be optimised. */
export function encodePlanRequest(change: number, needles: readonly PlanNeedle[] | null): Uint8Array {
  return encoded(writePlan, {
    kind: needles ? PlanKind.Edited : PlanKind.Optimised, flags: 0, change, airKermaStrengthU: 0, by: '',
    needles: (needles ?? []).map((needle) => ({...needle, flags: 0})),
  });
}

/** With its holes as the scene, which comes before it, names them. */
export const shownPlan = (plan: Plan, grid: TemplateGrid): Plan =>
  ({...plan, needles: plan.needles.map((needle) => ({...needle, hole: shownHole(needle.hole, grid)}))});

/** Each seed's centre behind the tip, mm. */
export function seedOffsets(train: string): number[] {
  const offsets: number[] = [];
  let behind = 0;
  for (const element of train) {
    if (element === 's') offsets.push(behind + SEED_MM / 2);
    behind += element === 's' ? SEED_MM : SPACER_MM;
  }
  return offsets;
}

/** The seeds of the plan in use, by their numbers. */
export function plannedSeeds(plan: Plan, grid: TemplateGrid): Map<number, PlannedSeed> {
  const seeds = new Map<number, PlannedSeed>();
  plan.needles.forEach((needle, index) => {
    const hole = holeOf(needle.hole, grid);
    if (!hole) return;
    const [x, y] = [grid.origin[0] + hole.column * grid.spacingMm, grid.origin[1] + hole.row * grid.spacingMm];
    seedOffsets(needle.train).forEach((offset, i) => {
      const position: Vec3 = [x, y, grid.origin[2] + needle.depthMm - offset];
      seeds.set(needle.firstSeed + i, {position, axis: [0, 0, 1], needle: index});
    });
  });
  return seeds;
}
