// The ultrasound scanner: IMAGE and SCANNER.
import {ByteReader, ProtocolError, encoded} from './bytes.js';
import {ImageFlag, ScannerArray, ScannerFlag, ScannerFreeze, readImage, readScanner, writeScanner} from './wire_generated.js';
import type {Image, Scanner as WireScanner} from './wire_generated.js';

export {ImageFlag, ScannerArray, ScannerFlag, ScannerFreeze} from './wire_generated.js';

/** `pose`: X_WI, (column · spacing, row · spacing, 0) to the world, mm. */
export interface UltrasoundImage extends Omit<Image, 'flags' | 'imageSequence' | 'data'> {
  /** The pixels are those of an earlier tick: the field folds since, or could not be inverted. */
  held: boolean;
  /** It is not known whether the field of these pixels folds. */
  uncertified: boolean;
  frozen: boolean;
  sequence: number;
  /** Gray values, rows from the top. */
  pixels: Uint8Array;
}

export function decodeImage(body: Uint8Array): UltrasoundImage {
  const {flags, imageSequence: sequence, data: pixels, ...image} = readImage(new ByteReader(body));
  // This viewer does not ask for compressed pixels.
  if (flags & ImageFlag.Zlib || pixels.length !== image.width * image.height)
    throw new ProtocolError('an image has not as many pixels as its size says');
  return {...image, sequence, pixels, held: (flags & ImageFlag.Held) !== 0, frozen: (flags & ImageFlag.Frozen) !== 0, uncertified: (flags & ImageFlag.Uncertified) !== 0};
}

export interface Scanner extends Omit<WireScanner, 'flags' | 'freeze'> {
  frozen: boolean;
  probeHasDevice: boolean;
  probeIsStepped: boolean;
}

export function decodeScanner(body: Uint8Array): Scanner {
  const {flags, freeze, ...scanner} = readScanner(new ByteReader(body));
  return {...scanner, frozen: freeze === ScannerFreeze.Frozen, probeHasDevice: (flags & ScannerFlag.ProbeHasDevice) !== 0,
          probeIsStepped: (flags & ScannerFlag.ProbeIsStepped) !== 0};
}

/** What to change; the rest stays as it is. */
export type ScannerRequest = Partial<Omit<Scanner, 'probeHasDevice' | 'probeIsStepped' | 'tick'>>;

export function encodeScanner(request: ScannerRequest): Uint8Array {
  const {array, frozen, depthMm, gainDb, dynamicRangeDb, tgcExtraDbPerCm, focusMm, probeDepthMm, probeRotationDeg} = request;
  return encoded(writeScanner, {
    array: array ?? ScannerArray.AsItIs, freeze: frozen === undefined ? ScannerFreeze.AsItIs : frozen ? ScannerFreeze.Frozen : ScannerFreeze.Live,
    flags: 0, tick: 0, depthMm: depthMm ?? NaN, gainDb: gainDb ?? NaN, dynamicRangeDb: dynamicRangeDb ?? NaN, tgcExtraDbPerCm: tgcExtraDbPerCm ?? NaN,
    focusMm: focusMm ?? NaN, probeDepthMm: probeDepthMm ?? NaN, probeRotationDeg: probeRotationDeg ?? NaN,
  });
}
