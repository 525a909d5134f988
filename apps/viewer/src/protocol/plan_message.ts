// PLAN: the plan in use, and an operator's request to change what is left of it.
import {ByteReader, ByteWriter, ProtocolError, type Vec3} from './bytes.js';
import {holeOf, type PlannedSeed, type TemplateGrid} from './scene_message.js';

export const PlanKind = {File: 1, Optimised: 2, Edited: 3} as const;

/** A train's elements from the tip backwards, mm. */
export const SEED_MM = 4.5;
export const SPACER_MM = 5.5;
const MOST_NEEDLES = 4096;

export interface PlanNeedle {
  /** That LOAD names. */
  number: number;
  /** A seed has left it: it stays as it is. */
  begun: boolean;
  /** Number of its first seed, which a seed's `planned` counts. */
  firstSeed: number;
  /** Of its tip beyond the template; NaN in a request: by the loading rule. */
  depthMm: number;
  hole: string;
  /** s a seed, - a spacer; empty in a request: by the loading rule. */
  train: string;
}

export interface Plan {
  kind: number;
  optimising: boolean;
  /** The changes since the scene's file. */
  change: number;
  airKermaStrengthU: number;
  by: string;
  needles: PlanNeedle[];
}

export function decodePlan(body: Uint8Array): Plan {
  const reader = new ByteReader(body);
  const kind = reader.u16();
  const optimising = (reader.u16() & 1) !== 0;
  const plan: Plan = {kind, optimising, change: reader.u32(), airKermaStrengthU: reader.f64(), by: reader.text(), needles: []};
  const count = reader.u16();
  reader.u16();
  if (count > MOST_NEEDLES) throw new ProtocolError('a plan has too many needles');
  reader.fits(count, 20);
  for (let i = 0; i < count; ++i) {
    const number = reader.u16();
    const begun = (reader.u16() & 1) !== 0;
    plan.needles.push({number, begun, firstSeed: reader.u32(), depthMm: reader.f64(), hole: reader.text(), train: reader.text()});
  }
  reader.sections(() => false);
  reader.finish();
  return plan;
}

/** `change`: of the plan that the request goes on from; `needles`: the rest as drawn, null: to be optimised. */
export function encodePlanRequest(change: number, needles: readonly PlanNeedle[] | null): Uint8Array {
  const writer = new ByteWriter();
  writer.u16(needles ? PlanKind.Edited : PlanKind.Optimised);
  writer.u16(0);
  writer.u32(change);
  writer.f64(0);
  writer.text('');
  writer.u16(needles?.length ?? 0);
  writer.u16(0);
  for (const needle of needles ?? []) {
    writer.u16(needle.number);
    writer.u16(0);
    writer.u32(needle.firstSeed);
    writer.f64(needle.depthMm);
    writer.text(needle.hole);
    writer.text(needle.train);
  }
  writer.u16(0);
  writer.u16(0);
  return writer.result();
}

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
