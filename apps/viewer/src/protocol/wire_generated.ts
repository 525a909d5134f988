// Codecs of all messages, and the wire's numbers. Written by scripts/ci/wire_clients.py from net/protocol.json, and not edited. Fields: net/PROTOCOL.md.
import {ProtocolError, section, type ByteReader, type ByteWriter, type Vec3} from './bytes.js';

export const VERSION = 1;
export const MAGIC = 1497584194;  // the bytes 42 52 43 59, little-endian
export const HEADER_BYTES = 32;
export const ANY_NEEDLE = 65535;
export const MessageType = {
  Hello: 1, Welcome: 2, Topology: 3, Frame: 4, Pose: 5, State: 6, Event: 7, Error: 8, Ping: 9, Force: 10,
  LocalModel: 11, Arm: 12, Drop: 13, Dose: 14, Control: 15, Scene: 16, Image: 17, Scanner: 18, Load: 19, Plan: 20,
  Contour: 21, Exercise: 22,
} as const;
export const Role = {
  Viewer: 1, Device: 2, Operator: 3,
} as const;
export const EventKind = {
  Note: 1, Contact: 2, Puncture: 3, Reset: 4, Attached: 5, Detached: 6, Warning: 7, Safety: 8, Seed: 9, Structure: 10,
  SeedLost: 11,
} as const;
export const ErrorCode = {
  Protocol: 1, Version: 2, TooLarge: 3, Busy: 4, DeviceBusy: 5, NotDevice: 6, PoseRefused: 7, PoseRate: 8, Timeout: 9,
  Shutdown: 10, NoNeedle: 11, NotOperator: 12, ControlRefused: 13, Unauthorised: 14, ScannerRefused: 15,
  PlanRefused: 16, LoadRefused: 17, ContourRefused: 18, ExerciseRefused: 19,
} as const;
export const PlanKind = {
  File: 1, Optimised: 2, Edited: 3,
} as const;
export const ControlAction = {
  Play: 1, Stop: 2, Reset: 3, Model: 4,
} as const;
export const ScannerArray = {
  AsItIs: 0, Transverse: 1, Sagittal: 2, EndFire: 3, Biplane: 4,
} as const;
export const ScannerFreeze = {
  AsItIs: 0, Live: 1, Frozen: 2,
} as const;
export const Subscription = {
  FullFrames: 1, PoseHistory: 2, Surface: 4, NoMesh: 8, Scene: 16, Ultrasound: 32, Plan: 64,
} as const;
export const ImageFlag = {
  Held: 1, Frozen: 2, Zlib: 4, Uncertified: 8,
} as const;
export const ScannerFlag = {
  ProbeHasDevice: 1, ProbeIsStepped: 2,
} as const;
export const ForceFlag = {
  Armed: 1, Ramping: 2, Latched: 4, Limited: 8, Expired: 16,
} as const;
export const ControlFlag = {
  ScriptIsThere: 1, ScriptPlays: 2, ScriptLoops: 4, PreparesModel: 8,
} as const;
export const FrameFlag = {
  Full: 1,
} as const;
export const SeedFlag = {
  Certified: 1, Outside: 2,
} as const;
export const GoalFlag = {
  Above: 1, OfPlan: 2,
} as const;
export const HoleFlag = {
  FromRight: 1, HalfSteps: 2,
} as const;
export const PlanFlag = {
  Optimising: 1,
} as const;
export const PlanNeedleFlag = {
  Begun: 1,
} as const;
export const PlayFlag = {
  Loop: 1,
} as const;

export interface Quantiles {
  count: number;
  p50: number;
  p99: number;
  p999: number;
  max: number;
}

export function readQuantiles(r: ByteReader): Quantiles {
  const count = r.u64();
  const p50 = r.f64();
  const p99 = r.f64();
  const p999 = r.f64();
  const max = r.f64();
  return {count, p50, p99, p999, max};
}

export function writeQuantiles(w: ByteWriter, v: Quantiles): void {
  w.u64(BigInt(v.count));
  w.f64(v.p50);
  w.f64(v.p99);
  w.f64(v.p999);
  w.f64(v.max);
}

export interface TickPose {
  tick: number;
  pose: ArrayLike<number>;
}

export function readTickPose(r: ByteReader): TickPose {
  const tick = r.u64();
  const pose = r.pose();
  return {tick, pose};
}

export function writeTickPose(w: ByteWriter, v: TickPose): void {
  w.u64(BigInt(v.tick));
  w.pose(v.pose);
}

export interface NeedlePoses {
  needle: number;
  poses: TickPose[];
}

export function readNeedlePoses(r: ByteReader): NeedlePoses {
  const needle = r.u16();
  r.skip(2);
  const count = r.u32();
  const poses = r.list(count, 104, () => readTickPose(r));
  return {needle, poses};
}

export function writeNeedlePoses(w: ByteWriter, v: NeedlePoses): void {
  w.u16(v.needle);
  w.zeros(2);
  w.u32(v.poses.length);
  for (const one of v.poses) writeTickPose(w, one);
}

export interface Button {
  needle: number;
  count: number;
  firstTick: number;
}

export function readButton(r: ByteReader): Button {
  const needle = r.u16();
  r.skip(2);
  const count = r.u32();
  const firstTick = r.u64();
  return {needle, count, firstTick};
}

export function writeButton(w: ByteWriter, v: Button): void {
  w.u16(v.needle);
  w.zeros(2);
  w.u32(v.count);
  w.u64(BigInt(v.firstTick));
}

export interface Refusal {
  count: number;
  code: number;
  text: string;
}

export function readRefusal(r: ByteReader): Refusal {
  const count = r.u64();
  const code = r.u16();
  const text = r.text();
  return {count, code, text};
}

export function writeRefusal(w: ByteWriter, v: Refusal): void {
  w.u64(BigInt(v.count));
  w.u16(v.code);
  w.text(v.text);
}

export interface SafetyCount {
  needle: number;
  code: number;
  count: number;
  text: string;
}

export function readSafetyCount(r: ByteReader): SafetyCount {
  const needle = r.u16();
  const code = r.u16();
  const count = r.u64();
  const text = r.text();
  return {needle, code, count, text};
}

export function writeSafetyCount(w: ByteWriter, v: SafetyCount): void {
  w.u16(v.needle);
  w.u16(v.code);
  w.u64(BigInt(v.count));
  w.text(v.text);
}

export interface DoseGoal {
  structure: string;
  figure: string;
  limit: number;
  flags: number;
  source: string;
}

export function readDoseGoal(r: ByteReader): DoseGoal {
  const structure = r.text();
  const figure = r.text();
  const limit = r.f64();
  const flags = r.u16();
  const source = r.text();
  return {structure, figure, limit, flags, source};
}

export function writeDoseGoal(w: ByteWriter, v: DoseGoal): void {
  w.text(v.structure);
  w.text(v.figure);
  w.f64(v.limit);
  w.u16(v.flags);
  w.text(v.source);
}

export interface PlanNeedle {
  number: number;
  flags: number;
  firstSeed: number;
  depthMm: number;
  hole: string;
  train: string;
}

export function readPlanNeedle(r: ByteReader): PlanNeedle {
  const number = r.u16();
  const flags = r.u16();
  const firstSeed = r.u32();
  const depthMm = r.f64();
  const hole = r.text();
  const train = r.text();
  return {number, flags, firstSeed, depthMm, hole, train};
}

export function writePlanNeedle(w: ByteWriter, v: PlanNeedle): void {
  w.u16(v.number);
  w.u16(v.flags);
  w.u32(v.firstSeed);
  w.f64(v.depthMm);
  w.text(v.hole);
  w.text(v.train);
}

export interface StructureColour {
  name: string;
  red: number;
  green: number;
  blue: number;
}

export function readStructureColour(r: ByteReader): StructureColour {
  const name = r.text();
  const red = r.u8();
  const green = r.u8();
  const blue = r.u8();
  r.skip(1);
  return {name, red, green, blue};
}

export function writeStructureColour(w: ByteWriter, v: StructureColour): void {
  w.text(v.name);
  w.u8(v.red);
  w.u8(v.green);
  w.u8(v.blue);
  w.zeros(1);
}

export interface ContourSlice {
  slice: number;
  tick: number;
  probeDepthMm: number;
  pose: ArrayLike<number>;
  points: [number, number][];
}

export function readContourSlice(r: ByteReader): ContourSlice {
  const slice = r.i32();
  const pointCount = r.u32();
  const tick = r.u64();
  const probeDepthMm = r.f64();
  const pose = r.pose();
  const points = r.list(pointCount, 16, (): [number, number] => [r.f64(), r.f64()]);
  return {slice, tick, probeDepthMm, pose, points};
}

export function writeContourSlice(w: ByteWriter, v: ContourSlice): void {
  w.i32(v.slice);
  w.u32(v.points.length);
  w.u64(BigInt(v.tick));
  w.f64(v.probeDepthMm);
  w.pose(v.pose);
  for (const [x, y] of v.points) { w.f64(x); w.f64(y); }
}

export interface SliceScore {
  slice: number;
  offsetMm: number;
  outlinedMm2: number;
  trueMm2: number;
  dice: number;
  hausdorffMm: number;
}

export function readSliceScore(r: ByteReader): SliceScore {
  const slice = r.i32();
  r.skip(4);
  const offsetMm = r.f64();
  const outlinedMm2 = r.f64();
  const trueMm2 = r.f64();
  const dice = r.f64();
  const hausdorffMm = r.f64();
  return {slice, offsetMm, outlinedMm2, trueMm2, dice, hausdorffMm};
}

export function writeSliceScore(w: ByteWriter, v: SliceScore): void {
  w.i32(v.slice);
  w.zeros(4);
  w.f64(v.offsetMm);
  w.f64(v.outlinedMm2);
  w.f64(v.trueMm2);
  w.f64(v.dice);
  w.f64(v.hausdorffMm);
}

export interface PlannedNeedle {
  tip: Vec3;
  hole: string;
}

export function readPlannedNeedle(r: ByteReader): PlannedNeedle {
  const tip = r.vec3();
  const hole = r.text();
  return {tip, hole};
}

export function writePlannedNeedle(w: ByteWriter, v: PlannedNeedle): void {
  for (const one of v.tip) w.f64(one);
  w.text(v.hole);
}

export interface PlannedSeed {
  position: Vec3;
  axis: Vec3;
  needle: number;
}

export function readPlannedSeed(r: ByteReader): PlannedSeed {
  const position = r.vec3();
  const axis = r.vec3();
  const needle = r.u32();
  r.skip(4);
  return {position, axis, needle};
}

export function writePlannedSeed(w: ByteWriter, v: PlannedSeed): void {
  for (const one of v.position) w.f64(one);
  for (const one of v.axis) w.f64(one);
  w.u32(v.needle);
  w.zeros(4);
}

export interface SceneStructure {
  name: string;
  vertices: Float32Array;
  triangles: Uint32Array;
}

export function readSceneStructure(r: ByteReader): SceneStructure {
  const name = r.text();
  const vertexCount = r.u32();
  const triangleCount = r.u32();
  const vertices = r.f32Array(3 * vertexCount);
  const triangles = r.u32Array(3 * triangleCount);
  return {name, vertices, triangles};
}

export function writeSceneStructure(w: ByteWriter, v: SceneStructure): void {
  w.text(v.name);
  w.u32(v.vertices.length / 3);
  w.u32(v.triangles.length / 3);
  w.array(v.vertices);
  w.array(v.triangles);
}

export interface Forces {
  forceN: Vec3;
  tipTorqueNmm: Vec3;
  hubTorqueNmm: Vec3;
  axialN: number;
  lateralN: number;
  cuttingN: number;
  frictionN: number;
}

export function readForces(r: ByteReader): Forces {
  const forceN = r.vec3();
  const tipTorqueNmm = r.vec3();
  const hubTorqueNmm = r.vec3();
  const axialN = r.f64();
  const lateralN = r.f64();
  const cuttingN = r.f64();
  const frictionN = r.f64();
  return {forceN, tipTorqueNmm, hubTorqueNmm, axialN, lateralN, cuttingN, frictionN};
}

export function writeForces(w: ByteWriter, v: Forces): void {
  for (const one of v.forceN) w.f64(one);
  for (const one of v.tipTorqueNmm) w.f64(one);
  for (const one of v.hubTorqueNmm) w.f64(one);
  w.f64(v.axialN);
  w.f64(v.lateralN);
  w.f64(v.cuttingN);
  w.f64(v.frictionN);
}

export interface Needle {
  id: number;
  contact: number;
  present: boolean;
  landmarkCount: number;
  punctureCount: number;
  insertionDepthMm: number;
  pose: ArrayLike<number>;
}

export function readNeedle(r: ByteReader): Needle {
  const id = r.u16();
  const contact = r.u8();
  const present = r.boolean('present');
  const landmarkCount = r.u32();
  const punctureCount = r.u32();
  const insertionDepthMm = r.f64();
  const pose = r.pose();
  return {id, contact, present, landmarkCount, punctureCount, insertionDepthMm, pose};
}

export function writeNeedle(w: ByteWriter, v: Needle): void {
  w.u16(v.id);
  w.u8(v.contact);
  w.u8(Number(v.present));
  w.u32(v.landmarkCount);
  w.u32(v.punctureCount);
  w.f64(v.insertionDepthMm);
  w.pose(v.pose);
}

export interface NeedleForce {
  needle: number;
  inputSequence: number;
  inputStampNs: number;
  forces: Forces;
  tipDepthMm: number;
}

export function readNeedleForce(r: ByteReader): NeedleForce {
  const needle = r.u16();
  r.skip(6);
  const inputSequence = r.u64();
  const inputStampNs = r.u64();
  const forces = readForces(r);
  const tipDepthMm = r.f64();
  return {needle, inputSequence, inputStampNs, forces, tipDepthMm};
}

export function writeNeedleForce(w: ByteWriter, v: NeedleForce): void {
  w.u16(v.needle);
  w.zeros(6);
  w.u64(BigInt(v.inputSequence));
  w.u64(BigInt(v.inputStampNs));
  writeForces(w, v.forces);
  w.f64(v.tipDepthMm);
}

export interface Seed {
  id: number;
  planned: number;
  needle: number;
  source: number;
  flags: number;
  tick: number;
  tS: number;
  airKermaStrengthU: number;
  dropped: Vec3;
  droppedAxis: Vec3;
  rest: Vec3;
  restAxis: Vec3;
  glandMotion: Vec3;
  position: Vec3;
  axis: Vec3;
}

export function readSeed(r: ByteReader): Seed {
  const id = r.u32();
  const planned = r.i32();
  const needle = r.u16();
  const source = r.u16();
  const flags = r.u32();
  const tick = r.u64();
  const tS = r.f64();
  const airKermaStrengthU = r.f64();
  const dropped = r.vec3();
  const droppedAxis = r.vec3();
  const rest = r.vec3();
  const restAxis = r.vec3();
  const glandMotion = r.vec3();
  const position = r.vec3();
  const axis = r.vec3();
  return {id, planned, needle, source, flags, tick, tS, airKermaStrengthU, dropped, droppedAxis, rest, restAxis,
          glandMotion, position, axis};
}

export function writeSeed(w: ByteWriter, v: Seed): void {
  w.u32(v.id);
  w.i32(v.planned);
  w.u16(v.needle);
  w.u16(v.source);
  w.u32(v.flags);
  w.u64(BigInt(v.tick));
  w.f64(v.tS);
  w.f64(v.airKermaStrengthU);
  for (const one of v.dropped) w.f64(one);
  for (const one of v.droppedAxis) w.f64(one);
  for (const one of v.rest) w.f64(one);
  for (const one of v.restAxis) w.f64(one);
  for (const one of v.glandMotion) w.f64(one);
  for (const one of v.position) w.f64(one);
  for (const one of v.axis) w.f64(one);
}

export interface NeedleShape {
  needle: number;
  tipAxis: Vec3;
  tipDeflection: Vec3;
  points: Float32Array;
}

export function readNeedleShape(r: ByteReader): NeedleShape {
  const needle = r.u16();
  const pointCount = r.u16();
  if (pointCount < 2) throw new ProtocolError('NeedleShape: point_count is below 2');
  r.skip(4);
  const tipAxis = r.vec3();
  const tipDeflection = r.vec3();
  const points = r.f32Array(3 * pointCount);
  return {needle, tipAxis, tipDeflection, points};
}

export function writeNeedleShape(w: ByteWriter, v: NeedleShape): void {
  w.u16(v.needle);
  w.u16(v.points.length / 3);
  w.zeros(4);
  for (const one of v.tipAxis) w.f64(one);
  for (const one of v.tipDeflection) w.f64(one);
  w.array(v.points);
}

export interface StructureDose {
  name: string;
  volumeCc: number;
  meanGy: number;
  minGy: number;
  maxGy: number;
  v100Percent: number;
  v150Percent: number;
  v200Percent: number;
  v100Cc: number;
  d90Gy: number;
  d30Gy: number;
  d10Gy: number;
  d2ccGy: number;
  volumeShare: Float32Array;
}

export function readStructureDose(r: ByteReader): StructureDose {
  const name = r.text();
  const volumeCc = r.f64();
  const meanGy = r.f64();
  const minGy = r.f64();
  const maxGy = r.f64();
  const v100Percent = r.f64();
  const v150Percent = r.f64();
  const v200Percent = r.f64();
  const v100Cc = r.f64();
  const d90Gy = r.f64();
  const d30Gy = r.f64();
  const d10Gy = r.f64();
  const d2ccGy = r.f64();
  const binCount = r.u16();
  const volumeShare = r.f32Array(binCount);
  return {name, volumeCc, meanGy, minGy, maxGy, v100Percent, v150Percent, v200Percent, v100Cc, d90Gy, d30Gy, d10Gy,
          d2ccGy, volumeShare};
}

export function writeStructureDose(w: ByteWriter, v: StructureDose): void {
  w.text(v.name);
  w.f64(v.volumeCc);
  w.f64(v.meanGy);
  w.f64(v.minGy);
  w.f64(v.maxGy);
  w.f64(v.v100Percent);
  w.f64(v.v150Percent);
  w.f64(v.v200Percent);
  w.f64(v.v100Cc);
  w.f64(v.d90Gy);
  w.f64(v.d30Gy);
  w.f64(v.d10Gy);
  w.f64(v.d2ccGy);
  w.u16(v.volumeShare.length);
  w.array(v.volumeShare);
}

export interface HelloDevice {
  needle: number;
  flags: number;
}

export function readHelloDevice(r: ByteReader): HelloDevice {
  const needle = r.u16();
  const flags = r.u16();
  r.skip(4);
  return {needle, flags};
}

export function writeHelloDevice(w: ByteWriter, v: HelloDevice): void {
  w.u16(v.needle);
  w.u16(v.flags);
  w.zeros(4);
}

export interface HelloToken {
  token: Uint8Array;
}

export function readHelloToken(r: ByteReader): HelloToken {
  const token = r.part(32).slice();
  return {token};
}

export function writeHelloToken(w: ByteWriter, v: HelloToken): void {
  w.raw(v.token);
}

export interface HelloSoftware {
  software: string;
}

export function readHelloSoftware(r: ByteReader): HelloSoftware {
  const software = r.text();
  return {software};
}

export function writeHelloSoftware(w: ByteWriter, v: HelloSoftware): void {
  w.text(v.software);
}

export interface HelloImages {
  flags: number;
}

export function readHelloImages(r: ByteReader): HelloImages {
  const flags = r.u16();
  r.skip(6);
  return {flags};
}

export function writeHelloImages(w: ByteWriter, v: HelloImages): void {
  w.u16(v.flags);
  w.zeros(6);
}

export interface HelloSections {
  device: HelloDevice | null;
  token: HelloToken | null;
  software: HelloSoftware | null;
  images: HelloImages | null;
}

export interface Hello {
  role: number;
  subscription: number;
  maxForceN: number;
  maxStiffnessNPerMm: number;
  dampingNSPerMm: number;
  rateHz: number;
  name: string;
  sections: HelloSections;
}

export function readHello(r: ByteReader): Hello {
  const role = r.u16();
  r.skip(2);
  const subscription = r.u32();
  const maxForceN = r.f64();
  const maxStiffnessNPerMm = r.f64();
  const dampingNSPerMm = r.f64();
  const rateHz = r.f64();
  const name = r.text();
  const sections: HelloSections = {device: null, token: null, software: null, images: null};
  r.sections((id, s) => {
    if (id === 1) sections.device = readHelloDevice(s);
    else if (id === 2) sections.token = readHelloToken(s);
    else if (id === 3) sections.software = readHelloSoftware(s);
    else if (id === 4) sections.images = readHelloImages(s);
    else return false;
    return true;
  });
  r.finish();
  return {role, subscription, maxForceN, maxStiffnessNPerMm, dampingNSPerMm, rateHz, name, sections};
}

export function writeHello(w: ByteWriter, v: Hello): void {
  w.u16(v.role);
  w.zeros(2);
  w.u32(v.subscription);
  w.f64(v.maxForceN);
  w.f64(v.maxStiffnessNPerMm);
  w.f64(v.dampingNSPerMm);
  w.f64(v.rateHz);
  w.text(v.name);
  w.sections([section(1, v.sections.device, writeHelloDevice), section(2, v.sections.token, writeHelloToken), section(3, v.sections.software, writeHelloSoftware), section(4, v.sections.images, writeHelloImages)]);
}

export interface WelcomeDevice {
  needle: number;
  needleCount: number;
}

export function readWelcomeDevice(r: ByteReader): WelcomeDevice {
  const needle = r.u16();
  const needleCount = r.u16();
  r.skip(4);
  return {needle, needleCount};
}

export function writeWelcomeDevice(w: ByteWriter, v: WelcomeDevice): void {
  w.u16(v.needle);
  w.u16(v.needleCount);
  w.zeros(4);
}

export interface WelcomeLimits {
  maxForceN: number;
  maxStiffnessNPerMm: number;
  dampingNSPerMm: number;
  rateHz: number;
  notPlausible: number;
}

export function readWelcomeLimits(r: ByteReader): WelcomeLimits {
  const maxForceN = r.f64();
  const maxStiffnessNPerMm = r.f64();
  const dampingNSPerMm = r.f64();
  const rateHz = r.f64();
  const notPlausible = r.u32();
  r.skip(4);
  return {maxForceN, maxStiffnessNPerMm, dampingNSPerMm, rateHz, notPlausible};
}

export function writeWelcomeLimits(w: ByteWriter, v: WelcomeLimits): void {
  w.f64(v.maxForceN);
  w.f64(v.maxStiffnessNPerMm);
  w.f64(v.dampingNSPerMm);
  w.f64(v.rateHz);
  w.u32(v.notPlausible);
  w.zeros(4);
}

export interface WelcomeSections {
  device: WelcomeDevice | null;
  limits: WelcomeLimits | null;
}

export interface Welcome {
  session: number;
  role: number;
  subscription: number;
  deformationHz: number;
  snapshotHz: number;
  maxMessageBytes: number;
  maxPosesPerS: number;
  topologyHash: bigint;
  server: string;
  units: string;
  frame: string;
  sections: WelcomeSections;
}

export function readWelcome(r: ByteReader): Welcome {
  const session = r.u64();
  const role = r.u16();
  r.skip(2);
  const subscription = r.u32();
  const deformationHz = r.f64();
  const snapshotHz = r.f64();
  const maxMessageBytes = r.u32();
  const maxPosesPerS = r.u32();
  const topologyHash = r.u64Exact();
  const server = r.text();
  const units = r.text();
  const frame = r.text();
  const sections: WelcomeSections = {device: null, limits: null};
  r.sections((id, s) => {
    if (id === 1) sections.device = readWelcomeDevice(s);
    else if (id === 2) sections.limits = readWelcomeLimits(s);
    else return false;
    return true;
  });
  r.finish();
  return {session, role, subscription, deformationHz, snapshotHz, maxMessageBytes, maxPosesPerS, topologyHash, server,
          units, frame, sections};
}

export function writeWelcome(w: ByteWriter, v: Welcome): void {
  w.u64(BigInt(v.session));
  w.u16(v.role);
  w.zeros(2);
  w.u32(v.subscription);
  w.f64(v.deformationHz);
  w.f64(v.snapshotHz);
  w.u32(v.maxMessageBytes);
  w.u32(v.maxPosesPerS);
  w.u64(v.topologyHash);
  w.text(v.server);
  w.text(v.units);
  w.text(v.frame);
  w.sections([section(1, v.sections.device, writeWelcomeDevice), section(2, v.sections.limits, writeWelcomeLimits)]);
}

export interface Topology {
  hash: bigint;
  surfaceVertexCount: number;
  triangles: Uint32Array;
  restPositions: Float32Array;
  name: string;
}

export function readTopology(r: ByteReader): Topology {
  const hash = r.u64Exact();
  const surfaceVertexCount = r.u32();
  const pointCount = r.u32();
  const triangleCount = r.u32();
  r.skip(4);
  const triangles = r.u32Array(3 * triangleCount);
  const restPositions = r.f32Array(3 * pointCount);
  const name = r.text();
  r.sections(() => false);
  r.finish();
  return {hash, surfaceVertexCount, triangles, restPositions, name};
}

export function writeTopology(w: ByteWriter, v: Topology): void {
  w.u64(v.hash);
  w.u32(v.surfaceVertexCount);
  w.u32(v.restPositions.length / 3);
  w.u32(v.triangles.length / 3);
  w.zeros(4);
  w.array(v.triangles);
  w.array(v.restPositions);
  w.text(v.name);
  w.sections([]);
}

export interface FrameForce {
  entries: NeedleForce[];
}

export function readFrameForce(r: ByteReader): FrameForce {
  const count = r.u16();
  r.skip(2);
  const entries = r.list(count, 136, () => readNeedleForce(r));
  return {entries};
}

export function writeFrameForce(w: ByteWriter, v: FrameForce): void {
  w.u16(v.entries.length);
  w.zeros(2);
  for (const one of v.entries) writeNeedleForce(w, one);
}

export interface FrameSeeds {
  seedCount: number;
  entries: Seed[];
}

export function readFrameSeeds(r: ByteReader): FrameSeeds {
  const seedCount = r.u32();
  const count = r.u32();
  const entries = r.list(count, 208, () => readSeed(r));
  return {seedCount, entries};
}

export function writeFrameSeeds(w: ByteWriter, v: FrameSeeds): void {
  w.u32(v.seedCount);
  w.u32(v.entries.length);
  for (const one of v.entries) writeSeed(w, one);
}

export interface FrameCertificate {
  verdict: number;
  substeps: number;
  detBound: number;
  vertexDet: number;
  place: Vec3;
  marginMm: number;
  heldMm: number;
  heldN: number;
  condition: number;
}

export function readFrameCertificate(r: ByteReader): FrameCertificate {
  const verdict = r.u8();
  r.skip(3);
  const substeps = r.u32();
  const detBound = r.f64();
  const vertexDet = r.f64();
  const place = r.vec3();
  const marginMm = r.f64();
  const heldMm = r.f64();
  const heldN = r.f64();
  const condition = r.f64();
  return {verdict, substeps, detBound, vertexDet, place, marginMm, heldMm, heldN, condition};
}

export function writeFrameCertificate(w: ByteWriter, v: FrameCertificate): void {
  w.u8(v.verdict);
  w.zeros(3);
  w.u32(v.substeps);
  w.f64(v.detBound);
  w.f64(v.vertexDet);
  for (const one of v.place) w.f64(one);
  w.f64(v.marginMm);
  w.f64(v.heldMm);
  w.f64(v.heldN);
  w.f64(v.condition);
}

export interface FramePoseHistory {
  entries: TickPose[];
}

export function readFramePoseHistory(r: ByteReader): FramePoseHistory {
  const count = r.u32();
  const entries = r.list(count, 104, () => readTickPose(r));
  return {entries};
}

export function writeFramePoseHistory(w: ByteWriter, v: FramePoseHistory): void {
  w.u32(v.entries.length);
  for (const one of v.entries) writeTickPose(w, one);
}

export interface FramePosesOfNeedles {
  needles: NeedlePoses[];
}

export function readFramePosesOfNeedles(r: ByteReader): FramePosesOfNeedles {
  const needleCount = r.u16();
  r.skip(2);
  const needles = r.list(needleCount, 8, () => readNeedlePoses(r));
  return {needles};
}

export function writeFramePosesOfNeedles(w: ByteWriter, v: FramePosesOfNeedles): void {
  w.u16(v.needles.length);
  w.zeros(2);
  for (const one of v.needles) writeNeedlePoses(w, one);
}

export interface FrameButtons {
  entries: Button[];
}

export function readFrameButtons(r: ByteReader): FrameButtons {
  const count = r.u32();
  const entries = r.list(count, 16, () => readButton(r));
  return {entries};
}

export function writeFrameButtons(w: ByteWriter, v: FrameButtons): void {
  w.u32(v.entries.length);
  for (const one of v.entries) writeButton(w, one);
}

export interface FrameNeedleShapes {
  entries: NeedleShape[];
}

export function readFrameNeedleShapes(r: ByteReader): FrameNeedleShapes {
  const count = r.u16();
  r.skip(2);
  const entries = r.list(count, 56, () => readNeedleShape(r));
  return {entries};
}

export function writeFrameNeedleShapes(w: ByteWriter, v: FrameNeedleShapes): void {
  w.u16(v.entries.length);
  w.zeros(2);
  for (const one of v.entries) writeNeedleShape(w, one);
}

export interface FrameLag {
  lagMm: number;
}

export function readFrameLag(r: ByteReader): FrameLag {
  const lagMm = r.f32();
  return {lagMm};
}

export function writeFrameLag(w: ByteWriter, v: FrameLag): void {
  w.f32(v.lagMm);
}

export interface FrameSections {
  force: FrameForce | null;
  seeds: FrameSeeds | null;
  certificate: FrameCertificate | null;
  poseHistory: FramePoseHistory | null;
  posesOfNeedles: FramePosesOfNeedles | null;
  buttons: FrameButtons | null;
  needleShapes: FrameNeedleShapes | null;
  lag: FrameLag | null;
}

export interface Frame {
  topologyHash: bigint;
  tick: number;
  simTimeS: number;
  snapshotSequence: number;
  baseTick: number;
  overruns: number;
  publishNs: number;
  inputSequence: number;
  inputStampNs: number;
  inputReceivedNs: number;
  maxDisplacementMm: number;
  stepFlags: number;
  frameFlags: number;
  pointCount: number;
  movedVertices: number;
  needles: Needle[];
  ranges: Uint32Array;
  positions: Float32Array;
  sections: FrameSections;
}

export function readFrame(r: ByteReader): Frame {
  const topologyHash = r.u64Exact();
  const tick = r.u64();
  const simTimeS = r.f64();
  const snapshotSequence = r.u64();
  const baseTick = r.u64();
  const overruns = r.u64();
  const publishNs = r.u64();
  const inputSequence = r.u64();
  const inputStampNs = r.u64();
  const inputReceivedNs = r.u64();
  const maxDisplacementMm = r.f64();
  const stepFlags = r.u32();
  const frameFlags = r.u32();
  const pointCount = r.u32();
  const movedVertices = r.u32();
  const needleCount = r.u16();
  r.skip(2);
  const needles = r.list(needleCount, 116, () => readNeedle(r));
  const rangeCount = r.u32();
  const ranges = r.u32Array(2 * rangeCount);
  const positions = r.f32Array(3 * ranges.reduce((sum, value, i) => (i % 2 ? sum + value : sum), 0));
  const sections: FrameSections = {force: null, seeds: null, certificate: null, poseHistory: null, posesOfNeedles: null,
                                   buttons: null, needleShapes: null, lag: null};
  r.sections((id, s) => {
    if (id === 1) sections.force = readFrameForce(s);
    else if (id === 2) sections.seeds = readFrameSeeds(s);
    else if (id === 3) sections.certificate = readFrameCertificate(s);
    else if (id === 4) sections.poseHistory = readFramePoseHistory(s);
    else if (id === 5) sections.posesOfNeedles = readFramePosesOfNeedles(s);
    else if (id === 6) sections.buttons = readFrameButtons(s);
    else if (id === 7) sections.needleShapes = readFrameNeedleShapes(s);
    else if (id === 8) sections.lag = readFrameLag(s);
    else return false;
    return true;
  });
  r.finish();
  return {topologyHash, tick, simTimeS, snapshotSequence, baseTick, overruns, publishNs, inputSequence, inputStampNs,
          inputReceivedNs, maxDisplacementMm, stepFlags, frameFlags, pointCount, movedVertices, needles, ranges,
          positions, sections};
}

export function writeFrame(w: ByteWriter, v: Frame): void {
  w.u64(v.topologyHash);
  w.u64(BigInt(v.tick));
  w.f64(v.simTimeS);
  w.u64(BigInt(v.snapshotSequence));
  w.u64(BigInt(v.baseTick));
  w.u64(BigInt(v.overruns));
  w.u64(BigInt(v.publishNs));
  w.u64(BigInt(v.inputSequence));
  w.u64(BigInt(v.inputStampNs));
  w.u64(BigInt(v.inputReceivedNs));
  w.f64(v.maxDisplacementMm);
  w.u32(v.stepFlags);
  w.u32(v.frameFlags);
  w.u32(v.pointCount);
  w.u32(v.movedVertices);
  w.u16(v.needles.length);
  w.zeros(2);
  for (const one of v.needles) writeNeedle(w, one);
  w.u32(v.ranges.length / 2);
  w.array(v.ranges);
  w.array(v.positions);
  w.sections([section(1, v.sections.force, writeFrameForce), section(2, v.sections.seeds, writeFrameSeeds), section(3, v.sections.certificate, writeFrameCertificate), section(4, v.sections.poseHistory, writeFramePoseHistory), section(5, v.sections.posesOfNeedles, writeFramePosesOfNeedles), section(6, v.sections.buttons, writeFrameButtons), section(7, v.sections.needleShapes, writeFrameNeedleShapes), section(8, v.sections.lag, writeFrameLag)]);
}

export interface Pose {
  needle: number;
  flags: number;
  pose: ArrayLike<number>;
}

export function readPose(r: ByteReader): Pose {
  const needle = r.u16();
  const flags = r.u16();
  r.skip(4);
  const pose = r.pose();
  r.finish();
  return {needle, flags, pose};
}

export function writePose(w: ByteWriter, v: Pose): void {
  w.u16(v.needle);
  w.u16(v.flags);
  w.zeros(4);
  w.pose(v.pose);
}

export interface StateSafety {
  entries: SafetyCount[];
}

export function readStateSafety(r: ByteReader): StateSafety {
  const count = r.u16();
  r.skip(2);
  const entries = r.list(count, 14, () => readSafetyCount(r));
  return {entries};
}

export function writeStateSafety(w: ByteWriter, v: StateSafety): void {
  w.u16(v.entries.length);
  w.zeros(2);
  for (const one of v.entries) writeSafetyCount(w, one);
}

export interface StateControls {
  kernel: string;
  supportRadiusMm: number;
  flags: number;
}

export function readStateControls(r: ByteReader): StateControls {
  const kernel = r.text();
  const supportRadiusMm = r.f64();
  const flags = r.u32();
  return {kernel, supportRadiusMm, flags};
}

export function writeStateControls(w: ByteWriter, v: StateControls): void {
  w.text(v.kernel);
  w.f64(v.supportRadiusMm);
  w.u32(v.flags);
}

export interface StateDrops {
  eventsDropped: number;
}

export function readStateDrops(r: ByteReader): StateDrops {
  const eventsDropped = r.u64();
  return {eventsDropped};
}

export function writeStateDrops(w: ByteWriter, v: StateDrops): void {
  w.u64(BigInt(v.eventsDropped));
}

export interface StateSections {
  safety: StateSafety | null;
  controls: StateControls | null;
  drops: StateDrops | null;
}

export interface State {
  ticks: number;
  overruns: number;
  controlOverruns: number;
  tickMs: Quantiles;
  latenessMs: Quantiles;
  latencyMs: Quantiles;
  posesAccepted: number;
  snapshots: number;
  snapshotsSent: number;
  snapshotsDropped: number;
  clients: number;
  viewers: number;
  refusals: Refusal[];
  deviceHolder: string;
  sections: StateSections;
}

export function readState(r: ByteReader): State {
  const ticks = r.u64();
  const overruns = r.u64();
  const controlOverruns = r.u64();
  const tickMs = readQuantiles(r);
  const latenessMs = readQuantiles(r);
  const latencyMs = readQuantiles(r);
  const posesAccepted = r.u64();
  const snapshots = r.u64();
  const snapshotsSent = r.u64();
  const snapshotsDropped = r.u64();
  const clients = r.u32();
  const viewers = r.u32();
  const refusalCount = r.u16();
  r.skip(2);
  const refusals = r.list(refusalCount, 12, () => readRefusal(r));
  const deviceHolder = r.text();
  const sections: StateSections = {safety: null, controls: null, drops: null};
  r.sections((id, s) => {
    if (id === 1) sections.safety = readStateSafety(s);
    else if (id === 2) sections.controls = readStateControls(s);
    else if (id === 3) sections.drops = readStateDrops(s);
    else return false;
    return true;
  });
  r.finish();
  return {ticks, overruns, controlOverruns, tickMs, latenessMs, latencyMs, posesAccepted, snapshots, snapshotsSent,
          snapshotsDropped, clients, viewers, refusals, deviceHolder, sections};
}

export function writeState(w: ByteWriter, v: State): void {
  w.u64(BigInt(v.ticks));
  w.u64(BigInt(v.overruns));
  w.u64(BigInt(v.controlOverruns));
  writeQuantiles(w, v.tickMs);
  writeQuantiles(w, v.latenessMs);
  writeQuantiles(w, v.latencyMs);
  w.u64(BigInt(v.posesAccepted));
  w.u64(BigInt(v.snapshots));
  w.u64(BigInt(v.snapshotsSent));
  w.u64(BigInt(v.snapshotsDropped));
  w.u32(v.clients);
  w.u32(v.viewers);
  w.u16(v.refusals.length);
  w.zeros(2);
  for (const one of v.refusals) writeRefusal(w, one);
  w.text(v.deviceHolder);
  w.sections([section(1, v.sections.safety, writeStateSafety), section(2, v.sections.controls, writeStateControls), section(3, v.sections.drops, writeStateDrops)]);
}

export interface Event {
  kind: number;
  needle: number;
  tick: number;
  text: string;
}

export function readEvent(r: ByteReader): Event {
  const kind = r.u16();
  const needle = r.u16();
  r.skip(4);
  const tick = r.u64();
  const text = r.text();
  r.finish();
  return {kind, needle, tick, text};
}

export function writeEvent(w: ByteWriter, v: Event): void {
  w.u16(v.kind);
  w.u16(v.needle);
  w.zeros(4);
  w.u64(BigInt(v.tick));
  w.text(v.text);
}

export interface Error {
  code: number;
  fatal: boolean;
  reason: number;
  aboutSequence: number;
  text: string;
}

export function readError(r: ByteReader): Error {
  const code = r.u16();
  const fatal = r.boolean('fatal');
  r.skip(1);
  const reason = r.u16();
  r.skip(2);
  const aboutSequence = r.u64();
  const text = r.text();
  r.finish();
  return {code, fatal, reason, aboutSequence, text};
}

export function writeError(w: ByteWriter, v: Error): void {
  w.u16(v.code);
  w.u8(Number(v.fatal));
  w.zeros(1);
  w.u16(v.reason);
  w.zeros(2);
  w.u64(BigInt(v.aboutSequence));
  w.text(v.text);
}

export interface Ping {
  nonce: bigint;
  reply: boolean;
  echoedStampNs: bigint;
  receivedNs: bigint;
}

export function readPing(r: ByteReader): Ping {
  const nonce = r.u64Exact();
  const reply = r.boolean('reply');
  r.skip(7);
  const echoedStampNs = r.u64Exact();
  const receivedNs = r.u64Exact();
  r.finish();
  return {nonce, reply, echoedStampNs, receivedNs};
}

export function writePing(w: ByteWriter, v: Ping): void {
  w.u64(v.nonce);
  w.u8(Number(v.reply));
  w.zeros(7);
  w.u64(v.echoedStampNs);
  w.u64(v.receivedNs);
}

export interface Force {
  needle: number;
  flags: number;
  validMs: number;
  tick: number;
  inputSequence: number;
  inputStampNs: number;
  forces: Forces;
}

export function readForce(r: ByteReader): Force {
  const needle = r.u16();
  const flags = r.u16();
  const validMs = r.u16();
  r.skip(2);
  const tick = r.u64();
  const inputSequence = r.u64();
  const inputStampNs = r.u64();
  const forces = readForces(r);
  r.finish();
  return {needle, flags, validMs, tick, inputSequence, inputStampNs, forces};
}

export function writeForce(w: ByteWriter, v: Force): void {
  w.u16(v.needle);
  w.u16(v.flags);
  w.u16(v.validMs);
  w.zeros(2);
  w.u64(BigInt(v.tick));
  w.u64(BigInt(v.inputSequence));
  w.u64(BigInt(v.inputStampNs));
  writeForces(w, v.forces);
}

export interface LocalModel {
  needle: number;
  flags: number;
  contact: number;
  tick: number;
  inputSequence: number;
  inputStampNs: number;
  referenceTip: Vec3;
  contactPoint: Vec3;
  axis: Vec3;
  axialStiffnessNPerMm: number;
  axialMinN: number;
  axialMaxN: number;
  afterPunctureN: number;
  lateralN: Vec3;
  lateralStiffnessNPerMm: number;
  timeToLiveS: number;
  maxForceN: number;
  maxStiffnessNPerMm: number;
  maxSlewNPerMs: number;
  rampS: number;
}

export function readLocalModel(r: ByteReader): LocalModel {
  const needle = r.u16();
  const flags = r.u16();
  const contact = r.u16();
  r.skip(2);
  const tick = r.u64();
  const inputSequence = r.u64();
  const inputStampNs = r.u64();
  const referenceTip = r.vec3();
  const contactPoint = r.vec3();
  const axis = r.vec3();
  const axialStiffnessNPerMm = r.f64();
  const axialMinN = r.f64();
  const axialMaxN = r.f64();
  const afterPunctureN = r.f64();
  const lateralN = r.vec3();
  const lateralStiffnessNPerMm = r.f64();
  const timeToLiveS = r.f64();
  const maxForceN = r.f64();
  const maxStiffnessNPerMm = r.f64();
  const maxSlewNPerMs = r.f64();
  const rampS = r.f64();
  r.finish();
  return {needle, flags, contact, tick, inputSequence, inputStampNs, referenceTip, contactPoint, axis,
          axialStiffnessNPerMm, axialMinN, axialMaxN, afterPunctureN, lateralN, lateralStiffnessNPerMm, timeToLiveS,
          maxForceN, maxStiffnessNPerMm, maxSlewNPerMs, rampS};
}

export function writeLocalModel(w: ByteWriter, v: LocalModel): void {
  w.u16(v.needle);
  w.u16(v.flags);
  w.u16(v.contact);
  w.zeros(2);
  w.u64(BigInt(v.tick));
  w.u64(BigInt(v.inputSequence));
  w.u64(BigInt(v.inputStampNs));
  for (const one of v.referenceTip) w.f64(one);
  for (const one of v.contactPoint) w.f64(one);
  for (const one of v.axis) w.f64(one);
  w.f64(v.axialStiffnessNPerMm);
  w.f64(v.axialMinN);
  w.f64(v.axialMaxN);
  w.f64(v.afterPunctureN);
  for (const one of v.lateralN) w.f64(one);
  w.f64(v.lateralStiffnessNPerMm);
  w.f64(v.timeToLiveS);
  w.f64(v.maxForceN);
  w.f64(v.maxStiffnessNPerMm);
  w.f64(v.maxSlewNPerMs);
  w.f64(v.rampS);
}

export interface Arm {
  needle: number;
}

export function readArm(r: ByteReader): Arm {
  const needle = r.u16();
  r.skip(6);
  r.finish();
  return {needle};
}

export function writeArm(w: ByteWriter, v: Arm): void {
  w.u16(v.needle);
  w.zeros(6);
}

export interface Drop {
  needle: number;
  pressed: boolean;
}

export function readDrop(r: ByteReader): Drop {
  const needle = r.u16();
  const pressed = r.boolean('pressed');
  r.skip(5);
  r.finish();
  return {needle, pressed};
}

export function writeDrop(w: ByteWriter, v: Drop): void {
  w.u16(v.needle);
  w.u8(Number(v.pressed));
  w.zeros(5);
}

export interface DoseAtSurface {
  surfaceGy: Float32Array;
}

export function readDoseAtSurface(r: ByteReader): DoseAtSurface {
  const count = r.u32();
  r.skip(4);
  const surfaceGy = r.f32Array(count);
  return {surfaceGy};
}

export function writeDoseAtSurface(w: ByteWriter, v: DoseAtSurface): void {
  w.u32(v.surfaceGy.length);
  w.zeros(4);
  w.array(v.surfaceGy);
}

export interface DoseWithPlanned {
  structures: StructureDose[];
}

export function readDoseWithPlanned(r: ByteReader): DoseWithPlanned {
  const structureCount = r.u16();
  r.skip(6);
  const structures = r.list(structureCount, 100, () => readStructureDose(r));
  return {structures};
}

export function writeDoseWithPlanned(w: ByteWriter, v: DoseWithPlanned): void {
  w.u16(v.structures.length);
  w.zeros(6);
  for (const one of v.structures) writeStructureDose(w, one);
}

export interface DoseFraction {
  catheters: number;
  plannedCatheters: number;
  dwells: number;
  seconds: number;
}

export function readDoseFraction(r: ByteReader): DoseFraction {
  const catheters = r.u32();
  const plannedCatheters = r.u32();
  const dwells = r.u32();
  r.skip(4);
  const seconds = r.f64();
  return {catheters, plannedCatheters, dwells, seconds};
}

export function writeDoseFraction(w: ByteWriter, v: DoseFraction): void {
  w.u32(v.catheters);
  w.u32(v.plannedCatheters);
  w.u32(v.dwells);
  w.zeros(4);
  w.f64(v.seconds);
}

export interface DoseSections {
  atSurface: DoseAtSurface | null;
  withPlanned: DoseWithPlanned | null;
  fraction: DoseFraction | null;
}

export interface Dose {
  seeds: number;
  prescriptionGy: number;
  airKermaStrengthU: number;
  structures: StructureDose[];
  sections: DoseSections;
}

export function readDose(r: ByteReader): Dose {
  const seeds = r.u32();
  const structureCount = r.u16();
  r.skip(2);
  const prescriptionGy = r.f64();
  const airKermaStrengthU = r.f64();
  const structures = r.list(structureCount, 100, () => readStructureDose(r));
  const sections: DoseSections = {atSurface: null, withPlanned: null, fraction: null};
  r.sections((id, s) => {
    if (id === 1) sections.atSurface = readDoseAtSurface(s);
    else if (id === 2) sections.withPlanned = readDoseWithPlanned(s);
    else if (id === 3) sections.fraction = readDoseFraction(s);
    else return false;
    return true;
  });
  r.finish();
  return {seeds, prescriptionGy, airKermaStrengthU, structures, sections};
}

export function writeDose(w: ByteWriter, v: Dose): void {
  w.u32(v.seeds);
  w.u16(v.structures.length);
  w.zeros(2);
  w.f64(v.prescriptionGy);
  w.f64(v.airKermaStrengthU);
  for (const one of v.structures) writeStructureDose(w, one);
  w.sections([section(1, v.sections.atSurface, writeDoseAtSurface), section(2, v.sections.withPlanned, writeDoseWithPlanned), section(3, v.sections.fraction, writeDoseFraction)]);
}

export interface Control {
  action: number;
  flags: number;
  supportRadiusMm: number;
  kernel: string;
}

export function readControl(r: ByteReader): Control {
  const action = r.u16();
  const flags = r.u16();
  r.skip(4);
  const supportRadiusMm = r.f64();
  const kernel = r.text();
  r.sections(() => false);
  r.finish();
  return {action, flags, supportRadiusMm, kernel};
}

export function writeControl(w: ByteWriter, v: Control): void {
  w.u16(v.action);
  w.u16(v.flags);
  w.zeros(4);
  w.f64(v.supportRadiusMm);
  w.text(v.kernel);
  w.sections([]);
}

export interface SceneProbe {
  needle: number;
  diameterMm: number;
  lengthMm: number;
  rectalWallMm: number;
}

export function readSceneProbe(r: ByteReader): SceneProbe {
  const needle = r.u16();
  r.skip(6);
  const diameterMm = r.f64();
  const lengthMm = r.f64();
  const rectalWallMm = r.f64();
  return {needle, diameterMm, lengthMm, rectalWallMm};
}

export function writeSceneProbe(w: ByteWriter, v: SceneProbe): void {
  w.u16(v.needle);
  w.zeros(6);
  w.f64(v.diameterMm);
  w.f64(v.lengthMm);
  w.f64(v.rectalWallMm);
}

export interface SceneGoals {
  goals: DoseGoal[];
}

export function readSceneGoals(r: ByteReader): SceneGoals {
  const goalCount = r.u16();
  r.skip(2);
  const goals = r.list(goalCount, 16, () => readDoseGoal(r));
  return {goals};
}

export function writeSceneGoals(w: ByteWriter, v: SceneGoals): void {
  w.u16(v.goals.length);
  w.zeros(2);
  for (const one of v.goals) writeDoseGoal(w, one);
}

export interface SceneColours {
  colours: StructureColour[];
}

export function readSceneColours(r: ByteReader): SceneColours {
  const colourCount = r.u16();
  r.skip(2);
  const colours = r.list(colourCount, 6, () => readStructureColour(r));
  return {colours};
}

export function writeSceneColours(w: ByteWriter, v: SceneColours): void {
  w.u16(v.colours.length);
  w.zeros(2);
  for (const one of v.colours) writeStructureColour(w, one);
}

export interface SceneHoles {
  flags: number;
}

export function readSceneHoles(r: ByteReader): SceneHoles {
  const flags = r.u16();
  r.skip(6);
  return {flags};
}

export function writeSceneHoles(w: ByteWriter, v: SceneHoles): void {
  w.u16(v.flags);
  w.zeros(6);
}

export interface SceneSections {
  probe: SceneProbe | null;
  goals: SceneGoals | null;
  colours: SceneColours | null;
  holes: SceneHoles | null;
}

export interface Scene {
  needleLengthMm: number;
  needleDiameterMm: number;
  seedLengthMm: number;
  seedDiameterMm: number;
  prescriptionGy: number;
  templateOrigin: Vec3;
  templateSpacingMm: number;
  templateColumns: number;
  templateRows: number;
  plannedNeedles: PlannedNeedle[];
  plannedSeeds: PlannedSeed[];
  structures: SceneStructure[];
  kernels: string[];
  sections: SceneSections;
}

export function readScene(r: ByteReader): Scene {
  const needleLengthMm = r.f64();
  const needleDiameterMm = r.f64();
  const seedLengthMm = r.f64();
  const seedDiameterMm = r.f64();
  const prescriptionGy = r.f64();
  const templateOrigin = r.vec3();
  const templateSpacingMm = r.f64();
  const templateColumns = r.u16();
  const templateRows = r.u16();
  r.skip(4);
  const plannedNeedleCount = r.u32();
  const plannedSeedCount = r.u32();
  const plannedNeedles = r.list(plannedNeedleCount, 26, () => readPlannedNeedle(r));
  const plannedSeeds = r.list(plannedSeedCount, 56, () => readPlannedSeed(r));
  const structureCount = r.u16();
  r.skip(2);
  const structures = r.list(structureCount, 10, () => readSceneStructure(r));
  const kernelCount = r.u16();
  r.skip(2);
  const kernels = r.list(kernelCount, 2, () => r.text());
  const sections: SceneSections = {probe: null, goals: null, colours: null, holes: null};
  r.sections((id, s) => {
    if (id === 1) sections.probe = readSceneProbe(s);
    else if (id === 2) sections.goals = readSceneGoals(s);
    else if (id === 3) sections.colours = readSceneColours(s);
    else if (id === 4) sections.holes = readSceneHoles(s);
    else return false;
    return true;
  });
  r.finish();
  return {needleLengthMm, needleDiameterMm, seedLengthMm, seedDiameterMm, prescriptionGy, templateOrigin,
          templateSpacingMm, templateColumns, templateRows, plannedNeedles, plannedSeeds, structures, kernels,
          sections};
}

export function writeScene(w: ByteWriter, v: Scene): void {
  w.f64(v.needleLengthMm);
  w.f64(v.needleDiameterMm);
  w.f64(v.seedLengthMm);
  w.f64(v.seedDiameterMm);
  w.f64(v.prescriptionGy);
  for (const one of v.templateOrigin) w.f64(one);
  w.f64(v.templateSpacingMm);
  w.u16(v.templateColumns);
  w.u16(v.templateRows);
  w.zeros(4);
  w.u32(v.plannedNeedles.length);
  w.u32(v.plannedSeeds.length);
  for (const one of v.plannedNeedles) writePlannedNeedle(w, one);
  for (const one of v.plannedSeeds) writePlannedSeed(w, one);
  w.u16(v.structures.length);
  w.zeros(2);
  for (const one of v.structures) writeSceneStructure(w, one);
  w.u16(v.kernels.length);
  w.zeros(2);
  for (const one of v.kernels) w.text(one);
  w.sections([section(1, v.sections.probe, writeSceneProbe), section(2, v.sections.goals, writeSceneGoals), section(3, v.sections.colours, writeSceneColours), section(4, v.sections.holes, writeSceneHoles)]);
}

export interface Image {
  array: number;
  flags: number;
  width: number;
  height: number;
  imageSequence: number;
  tick: number;
  newestTick: number;
  publishNs: number;
  spacingMm: number;
  pose: ArrayLike<number>;
  data: Uint8Array;
}

export function readImage(r: ByteReader): Image {
  const array = r.u16();
  const flags = r.u16();
  const width = r.u16();
  if (width > 4096) throw new ProtocolError('IMAGE: width is above 4096');
  const height = r.u16();
  if (height > 4096) throw new ProtocolError('IMAGE: height is above 4096');
  const imageSequence = r.u64();
  const tick = r.u64();
  const newestTick = r.u64();
  const publishNs = r.u64();
  const spacingMm = r.f64();
  const pose = r.pose();
  const dataBytes = r.u32();
  const data = r.part(dataBytes).slice();
  r.sections(() => false);
  r.finish();
  return {array, flags, width, height, imageSequence, tick, newestTick, publishNs, spacingMm, pose, data};
}

export function writeImage(w: ByteWriter, v: Image): void {
  w.u16(v.array);
  w.u16(v.flags);
  w.u16(v.width);
  w.u16(v.height);
  w.u64(BigInt(v.imageSequence));
  w.u64(BigInt(v.tick));
  w.u64(BigInt(v.newestTick));
  w.u64(BigInt(v.publishNs));
  w.f64(v.spacingMm);
  w.pose(v.pose);
  w.u32(v.data.length);
  w.raw(v.data);
  w.sections([]);
}

export interface Scanner {
  array: number;
  freeze: number;
  flags: number;
  tick: number;
  depthMm: number;
  gainDb: number;
  dynamicRangeDb: number;
  tgcExtraDbPerCm: number;
  focusMm: number;
  probeDepthMm: number;
  probeRotationDeg: number;
}

export function readScanner(r: ByteReader): Scanner {
  const array = r.u16();
  const freeze = r.u16();
  const flags = r.u32();
  const tick = r.u64();
  const depthMm = r.f64();
  const gainDb = r.f64();
  const dynamicRangeDb = r.f64();
  const tgcExtraDbPerCm = r.f64();
  const focusMm = r.f64();
  const probeDepthMm = r.f64();
  const probeRotationDeg = r.f64();
  r.sections(() => false);
  r.finish();
  return {array, freeze, flags, tick, depthMm, gainDb, dynamicRangeDb, tgcExtraDbPerCm, focusMm, probeDepthMm,
          probeRotationDeg};
}

export function writeScanner(w: ByteWriter, v: Scanner): void {
  w.u16(v.array);
  w.u16(v.freeze);
  w.u32(v.flags);
  w.u64(BigInt(v.tick));
  w.f64(v.depthMm);
  w.f64(v.gainDb);
  w.f64(v.dynamicRangeDb);
  w.f64(v.tgcExtraDbPerCm);
  w.f64(v.focusMm);
  w.f64(v.probeDepthMm);
  w.f64(v.probeRotationDeg);
  w.sections([]);
}

export interface Load {
  needle: number;
  planNeedle: number;
}

export function readLoad(r: ByteReader): Load {
  const needle = r.u16();
  const planNeedle = r.u16();
  r.skip(4);
  r.finish();
  return {needle, planNeedle};
}

export function writeLoad(w: ByteWriter, v: Load): void {
  w.u16(v.needle);
  w.u16(v.planNeedle);
  w.zeros(4);
}

export interface Plan {
  kind: number;
  flags: number;
  change: number;
  airKermaStrengthU: number;
  by: string;
  needles: PlanNeedle[];
}

export function readPlan(r: ByteReader): Plan {
  const kind = r.u16();
  const flags = r.u16();
  const change = r.u32();
  const airKermaStrengthU = r.f64();
  const by = r.text();
  const needleCount = r.u16();
  if (needleCount > 4096) throw new ProtocolError('PLAN: needle_count is above 4096');
  r.skip(2);
  const needles = r.list(needleCount, 20, () => readPlanNeedle(r));
  r.sections(() => false);
  r.finish();
  return {kind, flags, change, airKermaStrengthU, by, needles};
}

export function writePlan(w: ByteWriter, v: Plan): void {
  w.u16(v.kind);
  w.u16(v.flags);
  w.u32(v.change);
  w.f64(v.airKermaStrengthU);
  w.text(v.by);
  w.u16(v.needles.length);
  w.zeros(2);
  for (const one of v.needles) writePlanNeedle(w, one);
  w.sections([]);
}

export interface Exercise {
  file: string;
  trainee: string;
}

export function readExercise(r: ByteReader): Exercise {
  const file = r.text();
  const trainee = r.text();
  r.sections(() => false);
  r.finish();
  return {file, trainee};
}

export function writeExercise(w: ByteWriter, v: Exercise): void {
  w.text(v.file);
  w.text(v.trainee);
  w.sections([]);
}

export interface ContourScore {
  dice: number;
  outlinedCm3: number;
  trueCm3: number;
  samePlanesCm3: number;
  volumeErrorPercent: number;
  hausdorffMm: number;
  hausdorff95Mm: number;
  meanMm: number;
  stepMm: number;
  missed: number;
  beyond: number;
  planes: SliceScore[];
}

export function readContourScore(r: ByteReader): ContourScore {
  const dice = r.f64();
  const outlinedCm3 = r.f64();
  const trueCm3 = r.f64();
  const samePlanesCm3 = r.f64();
  const volumeErrorPercent = r.f64();
  const hausdorffMm = r.f64();
  const hausdorff95Mm = r.f64();
  const meanMm = r.f64();
  const stepMm = r.f64();
  const missed = r.u16();
  const beyond = r.u16();
  const planeCount = r.u16();
  r.skip(2);
  const planes = r.list(planeCount, 48, () => readSliceScore(r));
  return {dice, outlinedCm3, trueCm3, samePlanesCm3, volumeErrorPercent, hausdorffMm, hausdorff95Mm, meanMm, stepMm,
          missed, beyond, planes};
}

export function writeContourScore(w: ByteWriter, v: ContourScore): void {
  w.f64(v.dice);
  w.f64(v.outlinedCm3);
  w.f64(v.trueCm3);
  w.f64(v.samePlanesCm3);
  w.f64(v.volumeErrorPercent);
  w.f64(v.hausdorffMm);
  w.f64(v.hausdorff95Mm);
  w.f64(v.meanMm);
  w.f64(v.stepMm);
  w.u16(v.missed);
  w.u16(v.beyond);
  w.u16(v.planes.length);
  w.zeros(2);
  for (const one of v.planes) writeSliceScore(w, one);
}

export interface ContourSections {
  score: ContourScore | null;
}

export interface Contour {
  aboutSequence: number;
  slices: ContourSlice[];
  sections: ContourSections;
}

export function readContour(r: ByteReader): Contour {
  const aboutSequence = r.u64();
  const sliceCount = r.u16();
  r.skip(2);
  const slices = r.list(sliceCount, 120, () => readContourSlice(r));
  const sections: ContourSections = {score: null};
  r.sections((id, s) => {
    if (id === 1) sections.score = readContourScore(s);
    else return false;
    return true;
  });
  r.finish();
  return {aboutSequence, slices, sections};
}

export function writeContour(w: ByteWriter, v: Contour): void {
  w.u64(BigInt(v.aboutSequence));
  w.u16(v.slices.length);
  w.zeros(2);
  for (const one of v.slices) writeContourSlice(w, one);
  w.sections([section(1, v.sections.score, writeContourScore)]);
}
