// Messages of a server other than the mesh: WELCOME, STATE, EVENT, ERROR, PING, FORCE, DOSE.
import {ByteReader} from './bytes.js';
import {ANY_NEEDLE, ControlFlag, readDose, readError, readEvent, readForce, readPing, readState, readWelcome} from './wire_generated.js';
import type {Dose as WireDose, DoseFraction, Error as ServerError, Event as ServerEvent, Force as HandForce, Ping, State as WireState, StateControls,
             StructureDose, Welcome as WireWelcome, WelcomeLimits} from './wire_generated.js';

export {ANY_NEEDLE, ErrorCode, EventKind, Role, Subscription} from './wire_generated.js';
export type {Error as ServerError, Event as ServerEvent, Force as HandForce, Ping, Quantiles, StructureDose} from './wire_generated.js';

export interface Welcome extends Omit<WireWelcome, 'sections'> {
  needle: number;
  needleCount: number;
  /** What was negotiated with a device. */
  limits: WelcomeLimits | null;
}

export function decodeWelcome(body: Uint8Array): Welcome {
  const {sections, ...welcome} = readWelcome(new ByteReader(body));
  return {...welcome, needle: ANY_NEEDLE, needleCount: 1, ...sections.device, limits: sections.limits};
}

export interface Controls extends Omit<StateControls, 'flags'> {
  scriptIsThere: boolean;
  scriptPlays: boolean;
  scriptLoops: boolean;
  preparesModel: boolean;
}

/** Quantiles in ms, since the daemon's start. */
export interface State extends Omit<WireState, 'sections'> {
  controls: Controls | null;
}

function controlsOf({flags, ...controls}: StateControls): Controls {
  const has = (flag: number): boolean => (flags & flag) !== 0;
  return {
    ...controls, scriptIsThere: has(ControlFlag.ScriptIsThere), scriptPlays: has(ControlFlag.ScriptPlays),
    scriptLoops: has(ControlFlag.ScriptLoops), preparesModel: has(ControlFlag.PreparesModel),
  };
}

export function decodeState(body: Uint8Array): State {
  const {sections, ...state} = readState(new ByteReader(body));
  return {...state, controls: sections.controls && controlsOf(sections.controls)};
}

export const decodeEvent = (body: Uint8Array): ServerEvent => readEvent(new ByteReader(body));
export const decodeError = (body: Uint8Array): ServerError => readError(new ByteReader(body));
export const decodePing = (body: Uint8Array): Ping => readPing(new ByteReader(body));
/** FORCE: the force to render; this viewer displays it. */
export const decodeForce = (body: Uint8Array): HandForce => readForce(new ByteReader(body));

/** `volumeShare`: share of the volume with at least 0, 1, 2, … % of the prescription. */
export interface Dose extends Omit<WireDose, 'sections'> {
  /** Gy at each surface vertex at rest; null: not sent. */
  surfaceGy: Float32Array | null;
  /** The same structures once the planned seeds still in their needles lie where the plan has them; null: not sent. */
  withPlanned: StructureDose[] | null;
  /** Of a source's dwells in catheters, in place of seeds; null: of seeds. */
  fraction: DoseFraction | null;
}

export function decodeDose(body: Uint8Array): Dose {
  const {sections, ...dose} = readDose(new ByteReader(body));
  return {...dose, surfaceGy: sections.atSurface?.surfaceGy ?? null, withPlanned: sections.withPlanned?.structures ?? null, fraction: sections.fraction};
}
