// Messages of this viewer: bodies of HELLO, POSE, PING, DROP, CONTROL.
import {encoded} from './bytes.js';
import {ControlAction, PlayFlag, writeControl, writeDrop, writeExercise, writeHello, writePing, writePose} from './wire_generated.js';

declare const VIEWER_VERSION: string;  // the build's

/** Identity of this page in HELLO. */
export const SOFTWARE = `brachyd viewer ${VIEWER_VERSION}`;

export interface Hello {
  role: number;
  subscription: number;
  name: string;
  /** Of a device: the requested needle (ANY_NEEDLE: any) and its rate. */
  device: {needle: number; rateHz: number} | null;
  /** 32 bytes, for a daemon that requires authentication. */
  token: Uint8Array | null;
  /** Name and version; absent: not sent. */
  software?: string;
}

export function encodeHello({role, subscription, name, device, token, software}: Hello): Uint8Array {
  return encoded(writeHello, {
    role, subscription, name,
    maxForceN: NaN, maxStiffnessNPerMm: NaN, dampingNSPerMm: NaN,  // a mouse renders no force
    rateHz: device ? device.rateHz : NaN,
    sections: {device: device && {needle: device.needle, flags: 0}, token: token && {token}, software: software ? {software} : null, images: null},
  });
}

/** X_WN, 3×4 row by row, mm. */
export function encodePose(needle: number, pose: ArrayLike<number>): Uint8Array {
  return encoded(writePose, {needle, flags: 0, pose});
}

export function encodePing(nonce: bigint, reply: {echoedStampNs: bigint; receivedNs: bigint} | null): Uint8Array {
  return encoded(writePing, {nonce, reply: reply !== null, echoedStampNs: reply?.echoedStampNs ?? 0n, receivedNs: reply?.receivedNs ?? 0n});
}

export function encodeDrop(needle: number, pressed: boolean): Uint8Array {
  return encoded(writeDrop, {needle, pressed});
}

export type Control =
  {action: 'play'; loop: boolean} | {action: 'stop'} | {action: 'reset'} | {action: 'model'; kernel: string; supportRadiusMm: number};

const ACTIONS = {play: ControlAction.Play, stop: ControlAction.Stop, reset: ControlAction.Reset, model: ControlAction.Model};

/** MODEL: an empty kernel and a support of NaN leave them as they are. */
export function encodeControl(control: Control): Uint8Array {
  return encoded(writeControl, {
    action: ACTIONS[control.action], flags: control.action === 'play' && control.loop ? PlayFlag.Loop : 0,
    supportRadiusMm: control.action === 'model' ? control.supportRadiusMm : 0, kernel: control.action === 'model' ? control.kernel : '',
  });
}

/** An operator begins an attempt; `file` as /exercises names it. */
export function encodeExercise(file: string, trainee: string): Uint8Array {
  return encoded(writeExercise, {file, trainee});
}
