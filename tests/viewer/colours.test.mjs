// Colours that stand for something, as they look to people with each of three kinds of colour blindness (G. M. Machado, M. M. Oliveira,
// L. A. F. Fernandes: A physiologically-based model for simulation of color vision deficiency, 2009, severity 1; on linear RGB).
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {test} from 'node:test';
import {viewer} from './viewer_module.mjs';

const EYES = {
  normal: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  protanopia: [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
  deuteranopia: [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
  tritanopia: [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
};
const TO_XYZ = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]];
const WHITE = [0.95047, 1, 1.08883];
const times = (matrix, v) => matrix.map((row) => row.reduce((sum, value, i) => sum + value * v[i], 0));
const linear = (rgb) => rgb.map((value) => (value / 255 <= 0.04045 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
const rgbOf = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

/** CIE L*a*b* of a colour as an eye sees it. */
function lab(rgb, eye) {
  const seen = times(EYES[eye], linear(rgb)).map((value) => Math.min(1, Math.max(0, value)));
  const f = times(TO_XYZ, seen).map((value, i) => (value / WHITE[i] > 0.008856 ? Math.cbrt(value / WHITE[i]) : 7.787 * (value / WHITE[i]) + 16 / 116));
  return [116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])];
}
const difference = (a, b, eye) => Math.hypot(...lab(a, eye).map((value, i) => value - lab(b, eye)[i]));

const CLEAR = 20;  // CIE76; 2.3 is a just noticeable difference of large patches

for (const eye of Object.keys(EYES)) {
  test(`${eye}: gland, urethra and rectum are told apart`, () => {
    const structures = ['prostate', 'urethra', 'rectum'].map((name, i) => rgbOf(viewer.structureColour(name, i)));
    for (const [i, a] of structures.entries())
      for (const b of structures.slice(0, i)) assert.ok(difference(a, b, eye) > CLEAR, `${a} and ${b}: ${difference(a, b, eye).toFixed(1)}`);
  });

  for (const quantity of ['dose', 'displacement'])
    test(`${eye}: the scale of ${quantity} grows ever lighter, and its ends and middle are far apart`, () => {
      const colours = Array.from({length: 41}, (_, i) => [...viewer.colourAt(quantity, i / 40)]);
      const light = colours.map((colour) => lab(colour, eye)[0]);
      for (let i = 1; i < light.length; ++i) assert.ok(light[i] > light[i - 1], `at ${i / 40}: ${light[i - 1]} to ${light[i]}`);
      for (const [a, b] of [[0, 20], [20, 40], [0, 40]]) assert.ok(difference(colours[a], colours[b], eye) > CLEAR, `${a} and ${b}`);
    });
}

test("the curves' colours of charts are told apart", () => {
  const style = readFileSync(new URL('../../apps/viewer/src/charts/chart.ts', import.meta.url), 'utf8');
  const colour = (name) => rgbOf(new RegExp(`${name}: '(#[0-9a-f]{6})'`).exec(style)[1]);
  for (const [a, b] of [['force', 'lateral'], ['det', 'bound'], ['det', 'force']])
    for (const eye of Object.keys(EYES)) assert.ok(difference(colour(a), colour(b), eye) > CLEAR, `${eye}: ${a} and ${b}: ${difference(colour(a), colour(b), eye).toFixed(1)}`);
});
