// Messages of this viewer: bodies of HELLO, POSE, PING, DROP, CONTROL.
import {ByteWriter} from './bytes.js';

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

export function encodeHello(hello: Hello): Uint8Array {
  const writer = new ByteWriter();
  writer.u16(hello.role);
  writer.u16(0);
  writer.u32(hello.subscription);
  writer.f64(NaN);  // a mouse renders no force
  writer.f64(NaN);
  writer.f64(NaN);
  writer.f64(hello.device ? hello.device.rateHz : NaN);
  writer.text(hello.name);
  writer.u16((hello.device ? 1 : 0) + (hello.token ? 1 : 0) + (hello.software ? 1 : 0));
  writer.u16(0);
  if (hello.device) {
    writer.u16(1);
    writer.u16(0);
    writer.u32(8);
    writer.u16(hello.device.needle);
    writer.u16(0);
    writer.u32(0);
  }
  if (hello.token) {
    writer.u16(2);
    writer.u16(0);
    writer.u32(hello.token.length);
    writer.raw(hello.token);
  }
  if (hello.software) {
    const payload = new ByteWriter();
    payload.text(hello.software);
    const bytes = payload.result();
    writer.u16(3);
    writer.u16(0);
    writer.u32(bytes.length);
    writer.raw(bytes);
  }
  return writer.result();
}

/** X_WN, 3×4 row by row, mm. */
export function encodePose(needle: number, pose: ArrayLike<number>): Uint8Array {
  const writer = new ByteWriter();
  writer.u16(needle);
  writer.u16(0);
  writer.u32(0);
  for (let i = 0; i < 12; ++i) writer.f64(pose[i]!);
  return writer.result();
}

export function encodePing(nonce: bigint, reply: {echoedStampNs: bigint; receivedNs: bigint} | null): Uint8Array {
  const writer = new ByteWriter();
  writer.u64(nonce);
  writer.u8(reply ? 1 : 0);
  writer.zeros(7);
  writer.u64(reply ? reply.echoedStampNs : 0n);
  writer.u64(reply ? reply.receivedNs : 0n);
  return writer.result();
}

export function encodeDrop(needle: number, pressed: boolean): Uint8Array {
  const writer = new ByteWriter();
  writer.u16(needle);
  writer.u8(pressed ? 1 : 0);
  writer.zeros(5);
  return writer.result();
}

export type Control =
  {action: 'play'; loop: boolean} | {action: 'stop'} | {action: 'reset'} | {action: 'model'; kernel: string; supportRadiusMm: number};

/** MODEL: an empty kernel and a support of NaN leave them as they are. */
export function encodeControl(control: Control): Uint8Array {
  const writer = new ByteWriter();
  writer.u16({play: 1, stop: 2, reset: 3, model: 4}[control.action]);
  writer.u16(control.action === 'play' && control.loop ? 1 : 0);
  writer.u32(0);
  writer.f64(control.action === 'model' ? control.supportRadiusMm : 0);
  writer.text(control.action === 'model' ? control.kernel : '');
  writer.u16(0);
  writer.u16(0);
  return writer.result();
}
