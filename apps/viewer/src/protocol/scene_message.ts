// SCENE: objects around the tissue, constant while the daemon runs.
import {ByteReader, ProtocolError, type Vec3} from './bytes.js';
import {GoalFlag, readScene} from './wire_generated.js';
import type {DoseGoal as WireGoal, PlannedNeedle, PlannedSeed, Scene, SceneProbe, SceneStructure} from './wire_generated.js';

export type {PlannedNeedle, PlannedSeed, SceneProbe, SceneStructure as Structure} from './wire_generated.js';

export interface TemplateGrid {
  /** Hole A1, mm; columns A, B, … along +x, rows 1, 2, … along +y, needles along +z. */
  origin: Vec3;
  spacingMm: number;
  columns: number;
  rows: number;
}
/** What a figure of the dose should be: "V100" and others, a later version's too; the limit in its unit: %, cm³ or Gy. */
export interface DoseGoal extends Omit<WireGoal, 'flags'> {
  above: boolean;
  /** Else of the implant. */
  ofPlan: boolean;
}
export interface SceneMessage extends Omit<Scene, 'templateOrigin' | 'templateSpacingMm' | 'templateColumns' | 'templateRows' | 'sections'> {
  template: TemplateGrid;
  plannedNeedles: PlannedNeedle[];
  plannedSeeds: PlannedSeed[];
  structures: SceneStructure[];
  /** A transrectal ultrasound probe: a cylinder with a round tip, posed as needle `needle`. */
  probe: SceneProbe | null;
  /** Empty: not sent. */
  goals: DoseGoal[];
  /** "#rrggbb" by a structure's name ("prostate": the tissue), of those whose file has one. */
  colours: Map<string, string>;
}

export function decodeScene(body: Uint8Array): SceneMessage {
  const {templateOrigin: origin, templateSpacingMm: spacingMm, templateColumns: columns, templateRows: rows, sections, ...scene} =
    readScene(new ByteReader(body));
  const {probe} = sections;
  if (scene.plannedSeeds.some((seed) => seed.needle >= scene.plannedNeedles.length))
    throw new ProtocolError('a planned seed names a needle that is not there');
  for (const {vertices, triangles} of scene.structures)
    for (const vertex of triangles)
      if (vertex >= vertices.length / 3) throw new ProtocolError("a structure's triangle names a vertex that is not there");
  if (probe && !(probe.diameterMm > 0 && probe.lengthMm > 0)) throw new ProtocolError('the probe has no size');
  const goals = (sections.goals?.goals ?? []).map(({flags, ...goal}) => ({
    ...goal, above: (flags & GoalFlag.Above) !== 0, ofPlan: (flags & GoalFlag.OfPlan) !== 0}));
  const colours = new Map((sections.colours?.colours ?? []).map(({name, red, green, blue}) =>
    [name, `#${[red, green, blue].map((value) => value.toString(16).padStart(2, '0')).join('')}`]));
  return {...scene, template: {origin, spacingMm, columns, rows}, probe, goals, colours};
}

/** "C7" → column and row of the grid, from 0; null where it names no hole of it. */
export function holeOf(name: string, grid: TemplateGrid): {column: number; row: number} | null {
  const match = /^([A-Z])(\d{1,2})$/.exec(name);
  if (!match) return null;
  const column = match[1]!.charCodeAt(0) - 65;
  const row = Number(match[2]) - 1;
  return column < grid.columns && row >= 0 && row < grid.rows ? {column, row} : null;
}
