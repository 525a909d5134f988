// The 32 bytes before every body (net/PROTOCOL.md, Header).
import {ByteReader, ByteWriter, ProtocolError} from './bytes.js';
import {HEADER_BYTES, MAGIC, VERSION} from './wire_generated.js';

export {HEADER_BYTES, MessageType, VERSION} from './wire_generated.js';

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
