// FRAMEs and recordings, written here by the page's tables and not by the viewer's own code.
import zlib from 'node:zlib';
import {golden} from './golden.mjs';

const HASH = 0x2f2673dd4fb1cdb3n;  // of the page's TOPOLOGY

export function message(type, stampNs, body) {
  const bytes = Buffer.alloc(32 + body.length);
  bytes.write('BRCY', 0, 'latin1');
  bytes.writeUInt16LE(1, 4);
  bytes.writeUInt16LE(type, 6);
  bytes.writeUInt32LE(body.length, 12);
  bytes.writeBigUInt64LE(1n, 16);
  bytes.writeBigUInt64LE(BigInt(stampNs), 24);
  body.copy(bytes, 32);
  return bytes;
}

/** All five points at `x`, or without it none changed; late by `lagMm`, or without it of a daemon that does not tell its lag. */
export function frame(tick, stampNs, x, full = false, lagMm = undefined) {
  const points = x === undefined ? 0 : 5;
  const ranges = points ? 1 : 0;
  const sections = 108 + 4 + 8 * ranges + 12 * points;
  const body = Buffer.alloc(sections + 4 + (lagMm === undefined ? 0 : 12));
  body.writeBigUInt64LE(HASH, 0);
  body.writeBigUInt64LE(BigInt(tick), 8);
  body.writeDoubleLE(tick * 0.005, 16);
  body.writeBigUInt64LE(BigInt(tick), 24);
  body.writeBigUInt64LE(BigInt(full ? 0 : tick - 1), 32);
  body.writeUInt32LE(full ? 1 : 0, 92);
  body.writeUInt32LE(5, 96);
  body.writeUInt32LE(ranges, 108);
  if (ranges) body.writeUInt32LE(5, 116);
  for (let i = 0; i < 3 * points; ++i) body.writeFloatLE(x, 120 + 4 * i);
  if (lagMm !== undefined) {
    body.writeUInt32LE(1 << 10, 88);
    body.writeUInt16LE(1, sections);
    body.writeUInt16LE(8, sections + 4);
    body.writeUInt32LE(4, sections + 8);
    body.writeFloatLE(lagMm, sections + 12);
  }
  return message(4, stampNs, body);
}

/** `kind`: EventKind; a note without. */
export function event(stampNs, text, kind = 1) {
  const body = Buffer.alloc(18 + text.length);
  body.writeUInt16LE(kind, 0);
  body.writeUInt16LE(text.length, 16);
  body.write(text, 18);
  return message(7, stampNs, body);
}

export const topology = Buffer.from(golden.get('TOPOLOGY'));

const table = Array.from({length: 256}, (_, i) => {
  let c = i;
  for (let bit = 0; bit < 8; ++bit) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});
const crcOf = zlib.crc32 ?? ((bytes) => (bytes.reduce((crc, byte) => table[(crc ^ byte) & 255] ^ (crc >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0);

/** A recording's file of these messages. */
export function recording(messages) {
  return Buffer.concat([Buffer.from('BRCYREC1'), ...messages.flatMap((bytes) => {
    const crc = Buffer.alloc(4);
    crc.writeUInt32LE(crcOf(bytes) >>> 0);
    return [bytes, crc];
  })]);
}
