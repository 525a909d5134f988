// Colour maps: one table for shaders, colour bars and text.
import {ClampToEdgeWrapping, DataTexture, LinearFilter, RGBAFormat} from 'three';

type Rgb = [number, number, number];

const hex = (colour: string): Rgb => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16)) as Rgb;

/** Displacement: uniform steps of lightness, from visible against the background to bright. */
const DISPLACEMENT = ['#4a6cae', '#4389bb', '#43a9b8', '#62c4a0', '#a3da86', '#e8e67c', '#fff7c8'].map(hex);
/** Dose, 0 … 200 % of the prescription: blue below it, yellow above, ever lighter, so that with any colour blindness each dose has a
 * lightness of its own. */
const DOSE = ['#2a3a86', '#33569f', '#4674ac', '#6891ab', '#93a993', '#bdb271', '#e0b855', '#f8cf6a', '#fff3c4'].map(hex);

export type Quantity = 'displacement' | 'dose';

const anchors = (quantity: Quantity): Rgb[] => (quantity === 'dose' ? DOSE : DISPLACEMENT);

/** `share` 0 … 1 of the scale. */
export function colourAt(quantity: Quantity, share: number): Rgb {
  const colours = anchors(quantity);
  const at = Math.min(Math.max(share, 0), 1) * (colours.length - 1);
  const i = Math.min(Math.floor(at), colours.length - 2);
  return [0, 1, 2].map((c) => colours[i]![c]! + (at - i) * (colours[i + 1]![c]! - colours[i]![c]!)) as Rgb;
}

export function cssGradient(quantity: Quantity): string {
  return `linear-gradient(to top, ${anchors(quantity).map((c) => `rgb(${c.join(',')})`).join(', ')})`;
}

/** 256 × 2: displacement, dose. */
export function colourTable(): DataTexture {
  const data = new Uint8Array(256 * 2 * 4);
  (['displacement', 'dose'] as const).forEach((quantity, row) => {
    for (let i = 0; i < 256; ++i) data.set([...colourAt(quantity, i / 255), 255], 4 * (256 * row + i));
  });
  const texture = new DataTexture(data, 256, 2, RGBAFormat);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

/** The smallest of 1, 2, 3, 5, 8, 10, … that is at least `value`, so that colour bars do not flicker. */
export function roundUp(value: number): number {
  if (!(value > 0)) return 1;
  const decade = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 3, 5, 8, 10].map((step) => step * decade).find((step) => step >= value * 0.999)!;
}
