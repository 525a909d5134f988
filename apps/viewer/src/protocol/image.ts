// The ultrasound scanner: IMAGE and SCANNER.
import {ByteReader, ByteWriter, ProtocolError} from './bytes.js';

export const ScannerArray = {AsItIs: 0, Transverse: 1, Sagittal: 2, EndFire: 3, Biplane: 4} as const;
export const ScannerFreeze = {AsItIs: 0, Live: 1, Frozen: 2} as const;
export const ImageFlag = {Held: 1, Frozen: 2, Zlib: 4} as const;
export const ScannerFlag = {ProbeHasDevice: 1, ProbeIsStepped: 2} as const;
const MOST_SIDE = 4096;

export interface UltrasoundImage {
  array: number;
  /** The pixels are those of an earlier tick: the field is not certified since. */
  held: boolean;
  frozen: boolean;
  width: number;
  height: number;
  sequence: number;
  tick: number;
  newestTick: number;
  publishNs: number;
  spacingMm: number;
  /** X_WI, 3×4 row by row: (column · spacing, row · spacing, 0) to the world, mm. */
  pose: Float64Array;
  /** Gray values, rows from the top. */
  pixels: Uint8Array;
}

export function decodeImage(body: Uint8Array): UltrasoundImage {
  const reader = new ByteReader(body);
  const array = reader.u16();
  const flags = reader.u16();
  const width = reader.u16();
  const height = reader.u16();
  if (width > MOST_SIDE || height > MOST_SIDE) throw new ProtocolError('an image is larger than 4096 x 4096 pixels');
  const image = {
    array, held: (flags & ImageFlag.Held) !== 0, frozen: (flags & ImageFlag.Frozen) !== 0, width, height, sequence: reader.u64(),
    tick: reader.u64(), newestTick: reader.u64(), publishNs: reader.u64(), spacingMm: reader.f64(), pose: reader.pose(),
    pixels: reader.part(reader.u32()).slice(),
  };
  reader.sections(() => false);
  reader.finish();
  // This viewer does not ask for compressed pixels.
  if (flags & ImageFlag.Zlib || image.pixels.length !== width * height) throw new ProtocolError('an image has not as many pixels as its size says');
  return image;
}

export interface Scanner {
  array: number;
  frozen: boolean;
  probeHasDevice: boolean;
  probeIsStepped: boolean;
  tick: number;
  depthMm: number;
  gainDb: number;
  dynamicRangeDb: number;
  tgcExtraDbPerCm: number;
  focusMm: number;
  probeDepthMm: number;
  probeRotationDeg: number;
}

export function decodeScanner(body: Uint8Array): Scanner {
  const reader = new ByteReader(body);
  const array = reader.u16();
  const frozen = reader.u16() === ScannerFreeze.Frozen;
  const flags = reader.u32();
  const scanner = {
    array, frozen, probeHasDevice: (flags & ScannerFlag.ProbeHasDevice) !== 0, probeIsStepped: (flags & ScannerFlag.ProbeIsStepped) !== 0,
    tick: reader.u64(), depthMm: reader.f64(), gainDb: reader.f64(), dynamicRangeDb: reader.f64(), tgcExtraDbPerCm: reader.f64(),
    focusMm: reader.f64(), probeDepthMm: reader.f64(), probeRotationDeg: reader.f64(),
  };
  reader.sections(() => false);
  reader.finish();
  return scanner;
}

/** What to change; the rest stays as it is. */
export type ScannerRequest = Partial<Omit<Scanner, 'probeHasDevice' | 'probeIsStepped' | 'tick'>>;

export function encodeScanner(request: ScannerRequest): Uint8Array {
  const writer = new ByteWriter();
  writer.u16(request.array ?? ScannerArray.AsItIs);
  writer.u16(request.frozen === undefined ? ScannerFreeze.AsItIs : request.frozen ? ScannerFreeze.Frozen : ScannerFreeze.Live);
  writer.u32(0);
  writer.u64(0n);
  for (const value of [request.depthMm, request.gainDb, request.dynamicRangeDb, request.tgcExtraDbPerCm, request.focusMm, request.probeDepthMm, request.probeRotationDeg])
    writer.f64(value ?? NaN);
  writer.u32(0);
  return writer.result();
}
