// SCENE: objects around the tissue, constant while the daemon runs.
import {ByteReader, ProtocolError, type Vec3} from './bytes.js';

export interface PlannedNeedle {
  tip: Vec3;
  hole: string;
}
export interface PlannedSeed {
  position: Vec3;
  axis: Vec3;
  needle: number;
}
export interface Structure {
  name: string;
  vertices: Float32Array;
  triangles: Uint32Array;
}
export interface TemplateGrid {
  /** Hole A1, mm; columns A, B, … along +x, rows 1, 2, … along +y, needles along +z. */
  origin: Vec3;
  spacingMm: number;
  columns: number;
  rows: number;
}
/** A transrectal ultrasound probe: a cylinder with a round tip, posed as needle `needle`. */
export interface SceneProbe {
  needle: number;
  diameterMm: number;
  lengthMm: number;
  rectalWallMm: number;
}
/** What a figure of the dose should be. */
export interface DoseGoal {
  structure: string;
  /** "V100" and others; a later version's too. */
  figure: string;
  /** In the figure's unit: %, cm³ or Gy. */
  limit: number;
  above: boolean;
  /** Else of the implant. */
  ofPlan: boolean;
  source: string;
}
export interface SceneMessage {
  needleLengthMm: number;
  needleDiameterMm: number;
  seedLengthMm: number;
  seedDiameterMm: number;
  prescriptionGy: number;
  template: TemplateGrid;
  plannedNeedles: PlannedNeedle[];
  plannedSeeds: PlannedSeed[];
  structures: Structure[];
  kernels: string[];
  probe: SceneProbe | null;
  /** Empty: not sent. */
  goals: DoseGoal[];
  /** "#rrggbb" by a structure's name ("prostate": the tissue), of those whose file has one. */
  colours: Map<string, string>;
}

const PROBE_SECTION = 1;
const GOALS_SECTION = 2;
const COLOURS_SECTION = 3;

export function decodeScene(body: Uint8Array): SceneMessage {
  const reader = new ByteReader(body);
  const needleLengthMm = reader.f64();
  const needleDiameterMm = reader.f64();
  const seedLengthMm = reader.f64();
  const seedDiameterMm = reader.f64();
  const prescriptionGy = reader.f64();
  const template = {origin: reader.vec3(), spacingMm: reader.f64(), columns: reader.u16(), rows: reader.u16()};
  reader.u32();
  const needleCount = reader.u32();
  const seedCount = reader.u32();
  const plannedNeedles: PlannedNeedle[] = [];
  reader.fits(needleCount, 26);
  for (let i = 0; i < needleCount; ++i) plannedNeedles.push({tip: reader.vec3(), hole: reader.text()});
  const plannedSeeds: PlannedSeed[] = [];
  reader.fits(seedCount, 56);
  for (let i = 0; i < seedCount; ++i) {
    plannedSeeds.push({position: reader.vec3(), axis: reader.vec3(), needle: reader.u32()});
    if (plannedSeeds[i]!.needle >= needleCount) throw new ProtocolError('a planned seed names a needle that is not there');
    reader.u32();
  }
  const structures: Structure[] = [];
  const structureCount = reader.u16();
  reader.u16();
  for (let i = 0; i < structureCount; ++i) structures.push(readStructure(reader));
  const kernels: string[] = [];
  const kernelCount = reader.u16();
  reader.u16();
  for (let i = 0; i < kernelCount; ++i) kernels.push(reader.text());
  let probe: SceneProbe | null = null;
  let goals: DoseGoal[] = [];
  let colours = new Map<string, string>();
  reader.sections((id, section) => {
    if (id === PROBE_SECTION) probe = readProbe(section);
    else if (id === GOALS_SECTION) goals = readGoals(section);
    else if (id === COLOURS_SECTION) colours = readColours(section);
    else return false;
    return true;
  });
  reader.finish();
  return {needleLengthMm, needleDiameterMm, seedLengthMm, seedDiameterMm, prescriptionGy, template, plannedNeedles,
          plannedSeeds, structures, kernels, probe, goals, colours};
}

function readProbe(reader: ByteReader): SceneProbe {
  const needle = reader.u16();
  reader.u16();
  reader.u32();
  const probe = {needle, diameterMm: reader.f64(), lengthMm: reader.f64(), rectalWallMm: reader.f64()};
  if (!(probe.diameterMm > 0 && probe.lengthMm > 0)) throw new ProtocolError('the probe has no size');
  return probe;
}

function readGoals(reader: ByteReader): DoseGoal[] {
  const goals: DoseGoal[] = [];
  const count = reader.u16();
  reader.u16();
  for (let i = 0; i < count; ++i) {
    const [structure, figure, limit, flags] = [reader.text(), reader.text(), reader.f64(), reader.u16()];
    goals.push({structure, figure, limit, above: (flags & 1) !== 0, ofPlan: (flags & 2) !== 0, source: reader.text()});
  }
  return goals;
}

function readColours(reader: ByteReader): Map<string, string> {
  const colours = new Map<string, string>();
  const count = reader.u16();
  reader.u16();
  for (let i = 0; i < count; ++i) {
    const name = reader.text();
    const rgb = [reader.u8(), reader.u8(), reader.u8()];
    reader.u8();
    colours.set(name, `#${rgb.map((value) => value.toString(16).padStart(2, '0')).join('')}`);
  }
  return colours;
}

function readStructure(reader: ByteReader): Structure {
  const name = reader.text();
  const vertexCount = reader.u32();
  const triangleCount = reader.u32();
  reader.fits(vertexCount, 12);
  const vertices = reader.f32Array(3 * vertexCount);
  reader.fits(triangleCount, 12);
  const triangles = reader.u32Array(3 * triangleCount);
  for (const vertex of triangles)
    if (vertex >= vertexCount) throw new ProtocolError("a structure's triangle names a vertex that is not there");
  return {name, vertices, triangles};
}

/** "C7" → column and row of the grid, from 0; null where it names no hole of it. */
export function holeOf(name: string, grid: TemplateGrid): {column: number; row: number} | null {
  const match = /^([A-Z])(\d{1,2})$/.exec(name);
  if (!match) return null;
  const column = match[1]!.charCodeAt(0) - 65;
  const row = Number(match[2]) - 1;
  return column < grid.columns && row >= 0 && row < grid.rows ? {column, row} : null;
}
