// SCENE: objects around the tissue, constant while the daemon runs.
import {ByteReader, ProtocolError, type Vec3} from './bytes.js';
import {GoalFlag, HoleFlag, readScene} from './wire_generated.js';
import type {DoseGoal as WireGoal, PlannedNeedle, PlannedSeed, Scene, SceneProbe, SceneStructure} from './wire_generated.js';

export type {PlannedNeedle, PlannedSeed, SceneProbe, SceneStructure as Structure} from './wire_generated.js';

export interface TemplateGrid {
  /** The hole of the least x and y, mm; columns along +x, rows along +y, needles along +z. */
  origin: Vec3;
  spacingMm: number;
  columns: number;
  rows: number;
  /** Column A is the last one, at the patient's right; else the first. */
  fromRight: boolean;
  /** Columns are A, a, B, b, …, rows 1, 1.5, 2, …. */
  halfSteps: boolean;
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
  const flags = sections.holes?.flags ?? 0;
  const template = {origin, spacingMm, columns, rows, fromRight: (flags & HoleFlag.FromRight) !== 0, halfSteps: (flags & HoleFlag.HalfSteps) !== 0};
  // A catheter with a course has a name, which may look like a hole's.
  const plannedNeedles = scene.plannedNeedles.map((needle) => {
    const hole = holeOf(needle.hole, onWire(template));
    const isThere = hole && Math.hypot(needle.tip[0] - origin[0] - hole.column * spacingMm, needle.tip[1] - origin[1] - hole.row * spacingMm) < spacingMm / 2;
    return isThere ? {...needle, hole: holeName(hole, template)} : needle;
  });
  return {...scene, plannedNeedles, template, probe, goals, colours};
}

export interface Hole {
  column: number;
  row: number;
}

/** The same holes as messages name them. */
const onWire = (grid: TemplateGrid): TemplateGrid => ({...grid, fromRight: false, halfSteps: false});

export function columnName(column: number, {columns, fromRight, halfSteps}: TemplateGrid): string {
  const letter = fromRight ? columns - 1 - column : column;
  return halfSteps ? String.fromCharCode((letter % 2 === 0 ? 65 : 97) + Math.floor(letter / 2)) : String.fromCharCode(65 + letter);
}

export const rowName = (row: number, {halfSteps}: TemplateGrid): string => String(halfSteps ? 1 + row / 2 : row + 1);

export const holeName = ({column, row}: Hole, grid: TemplateGrid): string => columnName(column, grid) + rowName(row, grid);

/** A message's name of a hole as it is shown; and the other way round. Other texts stay. */
export function shownHole(name: string, grid: TemplateGrid): string {
  const hole = holeOf(name, onWire(grid));
  return hole ? holeName(hole, grid) : name;
}
export function wireHole(name: string, grid: TemplateGrid): string {
  const hole = holeOf(name, grid);
  return hole ? holeName(hole, onWire(grid)) : name;
}

/** "C7", with half steps also "c7.5" → column and row of the grid, from 0; null where it names no hole of it. */
export function holeOf(name: string, grid: TemplateGrid): Hole | null {
  const match = (grid.halfSteps ? /^([A-Za-z])([1-9]\d?(?:\.5)?)$/ : /^([A-Z])([1-9]\d?)$/).exec(name);
  if (!match) return null;
  const code = match[1]!.charCodeAt(0);
  const letter = !grid.halfSteps ? code - 65 : code >= 97 ? 2 * (code - 97) + 1 : 2 * (code - 65);
  const row = grid.halfSteps ? 2 * (Number(match[2]) - 1) : Number(match[2]) - 1;
  return letter < grid.columns && row < grid.rows ? {column: grid.fromRight ? grid.columns - 1 - letter : letter, row} : null;
}
