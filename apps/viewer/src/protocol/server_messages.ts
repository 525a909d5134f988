// Messages of a server other than the mesh: WELCOME, STATE, EVENT, ERROR, PING, FORCE, DOSE.
import {ByteReader} from './bytes.js';

export const Role = {Viewer: 1, Device: 2, Operator: 3} as const;
export const Subscription = {Surface: 1 << 2, NoMesh: 1 << 3, Scene: 1 << 4, Ultrasound: 1 << 5, Plan: 1 << 6} as const;
export const ANY_NEEDLE = 0xffff;

export interface Welcome {
  session: number;
  role: number;
  subscription: number;
  deformationHz: number;
  snapshotHz: number;
  topologyHash: bigint;
  server: string;
  needle: number;
  needleCount: number;
  limits: Limits | null;  // of a device
}

/** What was negotiated with a device. */
export interface Limits {
  maxForceN: number;
  maxStiffnessNPerMm: number;
  dampingNSPerMm: number;
  rateHz: number;
  notPlausible: number;  // bits: force, stiffness, damping, rate
}

export function decodeWelcome(body: Uint8Array): Welcome {
  const reader = new ByteReader(body);
  const session = reader.u64();
  const role = reader.u16();
  reader.u16();
  const subscription = reader.u32();
  const deformationHz = reader.f64();
  const snapshotHz = reader.f64();
  reader.skip(8);  // largest body and pose rate
  const topologyHash = reader.u64Exact();
  const server = reader.text();
  reader.text();
  reader.text();
  const welcome: Welcome = {
    session, role, subscription, deformationHz, snapshotHz, topologyHash, server, needle: ANY_NEEDLE, needleCount: 1, limits: null,
  };
  reader.sections((id, section) => {
    if (id === 2) {
      welcome.limits = {
        maxForceN: section.f64(), maxStiffnessNPerMm: section.f64(), dampingNSPerMm: section.f64(), rateHz: section.f64(),
        notPlausible: section.u32(),
      };
      section.u32();
      return true;
    }
    if (id !== 1) return false;
    welcome.needle = section.u16();
    welcome.needleCount = section.u16();
    section.u32();
    return true;
  });
  reader.finish();
  return welcome;
}

/** ms, since the daemon's start. */
export interface Quantiles {
  count: number;
  p50: number;
  p99: number;
  p999: number;
  max: number;
}

export interface Controls {
  kernel: string;
  supportRadiusMm: number;
  scriptIsThere: boolean;
  scriptPlays: boolean;
  scriptLoops: boolean;
  preparesModel: boolean;
}

export interface State {
  ticks: number;
  overruns: number;
  tickMs: Quantiles;
  latenessMs: Quantiles;
  latencyMs: Quantiles;
  posesAccepted: number;
  snapshots: number;
  snapshotsSent: number;
  snapshotsDropped: number;
  clients: number;
  viewers: number;
  deviceHolder: string;
  controls: Controls | null;
}

function readQuantiles(reader: ByteReader): Quantiles {
  return {count: reader.u64(), p50: reader.f64(), p99: reader.f64(), p999: reader.f64(), max: reader.f64()};
}

function readControls(reader: ByteReader): Controls {
  const kernel = reader.text();
  const supportRadiusMm = reader.f64();
  const flags = reader.u32();
  return {
    kernel, supportRadiusMm, scriptIsThere: (flags & 1) !== 0, scriptPlays: (flags & 2) !== 0,
    scriptLoops: (flags & 4) !== 0, preparesModel: (flags & 8) !== 0,
  };
}

export function decodeState(body: Uint8Array): State {
  const reader = new ByteReader(body);
  const ticks = reader.u64();
  const overruns = reader.u64();
  reader.u64();  // of the idle timer thread
  const state: State = {
    ticks, overruns, tickMs: readQuantiles(reader), latenessMs: readQuantiles(reader), latencyMs: readQuantiles(reader),
    posesAccepted: reader.u64(), snapshots: reader.u64(), snapshotsSent: reader.u64(), snapshotsDropped: reader.u64(),
    clients: reader.u32(), viewers: reader.u32(), deviceHolder: '', controls: null,
  };
  const refusals = reader.u16();
  reader.u16();
  for (let i = 0; i < refusals; ++i) {
    reader.skip(10);
    reader.text();
  }
  state.deviceHolder = reader.text();
  reader.sections((id, section) => {
    if (id !== 2) return false;
    state.controls = readControls(section);
    return true;
  });
  reader.finish();
  return state;
}

export const EventKind = {
  Note: 1, Contact: 2, Puncture: 3, Reset: 4, Attached: 5, Detached: 6, Warning: 7, Safety: 8, Seed: 9, Structure: 10, SeedLost: 11,
} as const;

export interface ServerEvent {
  kind: number;
  needle: number;
  tick: number;
  text: string;
}

export function decodeEvent(body: Uint8Array): ServerEvent {
  const reader = new ByteReader(body);
  const kind = reader.u16();
  const needle = reader.u16();
  reader.u32();
  const event = {kind, needle, tick: reader.u64(), text: reader.text()};
  reader.finish();
  return event;
}

export const ErrorCode = {
  Protocol: 1, Version: 2, TooLarge: 3, Busy: 4, DeviceBusy: 5, NotDevice: 6, PoseRefused: 7, PoseRate: 8, Timeout: 9,
  Shutdown: 10, NoNeedle: 11, NotOperator: 12, ControlRefused: 13, Unauthorised: 14, ScannerRefused: 15,
  PlanRefused: 16, LoadRefused: 17, ContourRefused: 18,
} as const;

export interface ServerError {
  code: number;
  fatal: boolean;
  reason: number;
  aboutSequence: number;
  text: string;
}

export function decodeError(body: Uint8Array): ServerError {
  const reader = new ByteReader(body);
  const code = reader.u16();
  const fatal = reader.u8() === 1;
  reader.u8();
  const reason = reader.u16();
  reader.u16();
  const error = {code, fatal, reason, aboutSequence: reader.u64(), text: reader.text()};
  reader.finish();
  return error;
}

export interface Ping {
  nonce: bigint;
  reply: boolean;
  echoedStampNs: number;
  receivedNs: number;
}

export function decodePing(body: Uint8Array): Ping {
  const reader = new ByteReader(body);
  const nonce = reader.u64Exact();
  const reply = reader.u8() === 1;
  reader.skip(7);
  const ping = {nonce, reply, echoedStampNs: reader.u64(), receivedNs: reader.u64()};
  reader.finish();
  return ping;
}

export interface HandForce {
  needle: number;
  flags: number;
  axial: number;
  lateral: number;
}

/** FORCE: the force to render; this viewer displays it. */
export function decodeForce(body: Uint8Array): HandForce {
  const reader = new ByteReader(body);
  const needle = reader.u16();
  const flags = reader.u16();
  reader.skip(4 + 24 + 72);
  const force = {needle, flags, axial: reader.f64(), lateral: reader.f64()};
  reader.skip(16);
  reader.finish();
  return force;
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
  /** Share of the volume with at least 0, 1, 2, … % of the prescription. */
  volumeShare: Float32Array;
}

export interface Dose {
  seeds: number;
  prescriptionGy: number;
  airKermaStrengthU: number;
  structures: StructureDose[];
  /** Gy at each surface vertex at rest; null: not sent. */
  surfaceGy: Float32Array | null;
  /** The same structures once the planned seeds still in their needles lie where the plan has them; null: not sent. */
  withPlanned: StructureDose[] | null;
}

const AT_SURFACE_SECTION = 1;
const WITH_PLANNED_SECTION = 2;
const LEAST_STRUCTURE_BYTES = 2 + 12 * 8 + 2;

function readStructureDose(reader: ByteReader): StructureDose {
  const dose: StructureDose = {
    name: reader.text(), volumeCc: reader.f64(), meanGy: reader.f64(), minGy: reader.f64(), maxGy: reader.f64(),
    v100Percent: reader.f64(), v150Percent: reader.f64(), v200Percent: reader.f64(), v100Cc: reader.f64(),
    d90Gy: reader.f64(), d30Gy: reader.f64(), d10Gy: reader.f64(), d2ccGy: reader.f64(), volumeShare: new Float32Array(),
  };
  dose.volumeShare = reader.f32Array(reader.u16());
  return dose;
}

function readStructureDoses(reader: ByteReader, count: number): StructureDose[] {
  return Array.from({length: reader.fits(count, LEAST_STRUCTURE_BYTES)}, () => readStructureDose(reader));
}

export function decodeDose(body: Uint8Array): Dose {
  const reader = new ByteReader(body);
  const seeds = reader.u32();
  const structureCount = reader.u16();
  reader.u16();
  const dose: Dose = {seeds, prescriptionGy: reader.f64(), airKermaStrengthU: reader.f64(), structures: [], surfaceGy: null, withPlanned: null};
  dose.structures = readStructureDoses(reader, structureCount);
  reader.sections((id, section) => {
    if (id === WITH_PLANNED_SECTION) {
      const planned = section.u16();
      section.skip(6);
      dose.withPlanned = readStructureDoses(section, planned);
      return true;
    }
    if (id !== AT_SURFACE_SECTION) return false;
    const count = section.u32();
    section.u32();
    section.fits(count, 4);
    dose.surfaceGy = section.f32Array(count);
    return true;
  });
  reader.finish();
  return dose;
}
