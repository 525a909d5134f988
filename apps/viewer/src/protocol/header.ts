// The 32 bytes before every body (net/PROTOCOL.md, Header).
import {ByteReader, ByteWriter, ProtocolError} from './bytes.js';

export const HEADER_BYTES = 32;
export const VERSION = 1;
const MAGIC = 0x59435242;  // "BRCY"

export const MessageType = {
  Hello: 1, Welcome: 2, Topology: 3, Frame: 4, Pose: 5, State: 6, Event: 7, Error: 8, Ping: 9, Force: 10, LocalModel: 11,
  Arm: 12, Drop: 13, Dose: 14, Control: 15, Scene: 16, Image: 17, Scanner: 18, Load: 19, Plan: 20, Contour: 21,
} as const;

export interface Header {
  type: number;
  length: number;
  sequence: number;
  stampNs: number;
  /** The same, exactly: PING sends it back. */
  stampExact: bigint;
}

export function decodeHeader(bytes: Uint8Array): Header {
  const reader = new ByteReader(bytes.subarray(0, HEADER_BYTES));
  if (reader.u32() !== MAGIC) throw new ProtocolError('this is no brachyd message: the magic is wrong');
  const version = reader.u16();
  if (version !== VERSION) throw new ProtocolError(`the other side speaks version ${version}, this viewer ${VERSION}`);
  const type = reader.u16();
  reader.u32();
  const length = reader.u32();
  const sequence = reader.u64();
  const stampExact = reader.u64Exact();
  return {type, length, sequence, stampNs: Number(stampExact), stampExact};
}

export function encodeMessage(type: number, sequence: number, stampNs: bigint, body: Uint8Array): Uint8Array<ArrayBuffer> {
  const writer = new ByteWriter();
  writer.u32(MAGIC);
  writer.u16(VERSION);
  writer.u16(type);
  writer.u32(0);
  writer.u32(body.length);
  writer.u64(BigInt(sequence));
  writer.u64(stampNs);
  const message = new Uint8Array(HEADER_BYTES + body.length);
  message.set(writer.result());
  message.set(body, HEADER_BYTES);
  return message;
}
