// CONTOUR: a volume study's outlines to the daemon, and its score.
import {ByteReader, encoded} from './bytes.js';
import {readContour, writeContour, type ContourScore, type ContourSlice} from './wire_generated.js';

/** `points` in mm in the plane. Of a request an operator's outline, of an answer the gland's own. */
export type {ContourSlice} from './wire_generated.js';

/** In PlaneScore's `slice`: not outlined. */
export const MISSED = -1;

export interface Contour {
  aboutSequence: number;
  slices: ContourSlice[];
  score: ContourScore | null;
}

export function encodeContour(slices: readonly ContourSlice[]): Uint8Array {
  return encoded(writeContour, {aboutSequence: 0, slices: [...slices], sections: {score: null}});
}

export function decodeContour(body: Uint8Array): Contour {
  const {sections, ...contour} = readContour(new ByteReader(body));
  return {...contour, score: sections.score};
}
