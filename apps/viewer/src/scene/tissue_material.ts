// How tissue is drawn: surface, its wires, points and slice share these shaders and settings. Clipping goes by the shape at
// rest, so that what is cut is a material section and moves with the tissue.
import {DoubleSide, FrontSide, ShaderMaterial, Vector3, type IUniform, type Texture} from 'three';

export interface TissueUniforms extends Record<string, IUniform> {
  table: IUniform<Texture>;
  /** 0 plain, 1 displacement, 2 dose. */
  mode: IUniform<number>;
  /** What the tops of the colour bars stand for, mm and Gy. */
  mostMm: IUniform<number>;
  mostGy: IUniform<number>;
  clip: IUniform<boolean>;
  /** Kept: dot(normal, rest) ≤ offset. */
  clipNormal: IUniform<Vector3>;
  clipOffset: IUniform<number>;
}

export function tissueUniforms(table: Texture): TissueUniforms {
  return {
    table: {value: table}, mode: {value: 0}, mostMm: {value: 1}, mostGy: {value: 1}, clip: {value: false},
    clipNormal: {value: new Vector3(0, 0, 1)}, clipOffset: {value: 0},
  };
}

const VERTEX = /* glsl */ `
attribute vec3 rest;
attribute float extra;   // surface: dose; slice: distance outside the gland
varying vec3 vView, vNormal, vRest;
varying float vDisplacement, vExtra;
uniform float pointSize;
void main() {
  vRest = rest;
  vDisplacement = length(position - rest);
  vExtra = extra;
  vec4 view = modelViewMatrix * vec4(position, 1.0);
  vView = -view.xyz;
  #ifdef SURFACE
  vNormal = normalMatrix * normal;
  #endif
  gl_Position = projectionMatrix * view;
  #ifdef POINTS
  gl_PointSize = clamp(pointSize / vView.z, 1.5, 12.0);
  #endif
}`;

const FRAGMENT = /* glsl */ `
uniform sampler2D table;
uniform int mode;
uniform float mostMm, mostGy, opacity, clipOffset;
uniform bool clip;
uniform vec3 clipNormal, plain;
varying vec3 vView, vNormal, vRest;
varying float vDisplacement, vExtra;

vec3 scaled(float share, float row) { return texture2D(table, vec2(clamp(share, 0.0, 1.0) * 0.996 + 0.002, row)).rgb; }

// Thin lines at every tenth of the scale.
float contour(float share) {
  float tenths = 10.0 * share;
  float width = fwidth(tenths);
  return width > 0.4 || tenths < 0.5 ? 0.0 : 1.0 - smoothstep(0.6, 1.6, abs(fract(tenths - 0.5) - 0.5) / max(width, 1e-5));
}

void main() {
  #ifndef SLICE
  if (clip && dot(clipNormal, vRest) > clipOffset) discard;
  #endif
  vec3 colour = plain;
  float share = mode == 2 ? vExtra / mostGy : vDisplacement / mostMm;
  if (mode == 1) colour = scaled(share, 0.25);
  if (mode == 2 && vExtra >= 0.0) colour = scaled(share, 0.75);
  float alpha = opacity;
  #ifdef SURFACE
  if (mode != 0) colour *= 1.0 - 0.3 * contour(share);
  vec3 n = normalize(vNormal);
  vec3 v = normalize(vView);
  float facing = dot(n, v);
  bool outside = facing > 0.0;  // gl_FrontFacing is turned round while three.js draws the far side
  if (!outside) { n = -n; facing = -facing; }
  vec3 light = normalize(vec3(-0.35, 0.6, 0.75));
  float diffuse = 0.5 + 0.5 * dot(n, light);
  float highlight = outside ? pow(max(dot(reflect(-light, n), v), 0.0), 70.0) : 0.0;
  float rim = pow(1.0 - facing, 2.0);
  colour = colour * (0.50 + 0.72 * diffuse) + 0.22 * highlight + rim * 0.22 * vec3(0.75, 0.85, 1.0);
  alpha = opacity >= 1.0 ? 1.0 : clamp(opacity * mix(0.7, 1.7, rim) + 0.3 * highlight * opacity, 0.0, 1.0);
  #endif
  #ifdef POINTS
  vec2 c = gl_PointCoord - 0.5;
  if (dot(c, c) > 0.25) discard;
  #endif
  #ifdef SLICE
  if (vExtra > 0.0) discard;
  colour *= 1.0 - 0.25 * contour(share);
  float edge = -vExtra / max(fwidth(vExtra), 1e-5);
  colour = mix(vec3(0.92, 0.96, 1.0), colour, smoothstep(1.0, 2.5, edge));
  #endif
  gl_FragColor = vec4(colour, alpha);
}`;

export function tissueMaterial(kind: 'SURFACE' | 'WIRES' | 'POINTS' | 'SLICE', shared: TissueUniforms, plain: [number, number, number],
                               opacity: number): ShaderMaterial {
  const material = new ShaderMaterial({
    vertexShader: VERTEX, fragmentShader: FRAGMENT, defines: {[kind]: 1},
    uniforms: {...shared, plain: {value: new Vector3(...plain)}, opacity: {value: opacity}, pointSize: {value: 500}},
    transparent: kind === 'SURFACE' || kind === 'WIRES',
    side: kind === 'POINTS' || kind === 'WIRES' ? FrontSide : DoubleSide,
    depthWrite: kind === 'POINTS' || kind === 'SLICE',
  });
  material.forceSinglePass = kind !== 'SURFACE';  // a glassy surface: its far side first
  return material;
}
