// How a needle's shaft bends: its vertices are moved across it in the vertex shader, so that nothing is uploaded but uniforms.
import {Vector3, type MeshPhongMaterial} from 'three';
import type {Needle} from '../protocol/frame.js';

/** Stations along the shaft, from the hub to the tip at equal arc lengths. */
const STATIONS = 17;

// Catmull–Rom between the stations. Sections stay perpendicular to the straight shaft: a shear, whose normals turn with it.
const DECLARATIONS = `
uniform vec3 deflections[${STATIONS}];
uniform float shaftMm;
vec3 deflectionAt(float z, out vec3 slope) {
  float place = clamp(1.0 + z / shaftMm, 0.0, 1.0) * ${STATIONS - 1}.0;
  int i = min(int(place), ${STATIONS - 2});
  float t = place - float(i);
  vec3 a = deflections[i], b = deflections[i + 1];
  vec3 before = i > 0 ? 0.5 * (b - deflections[i - 1]) : b - a;
  vec3 after = i < ${STATIONS - 2} ? 0.5 * (deflections[i + 2] - a) : b - a;
  vec3 c2 = 3.0 * (b - a) - 2.0 * before - after, c3 = 2.0 * (a - b) + before + after;
  slope = (before + t * (2.0 * c2 + t * 3.0 * c3)) * (${STATIONS - 1}.0 / shaftMm);
  return a + t * (before + t * (c2 + t * c3));
}
`;

export class NeedleBend {
  /** Off the straight shaft, in the needle's frame, mm. */
  private readonly deflections = Array.from({length: STATIONS}, () => new Vector3());

  constructor(private readonly lengthMm: number) {}

  /** Makes `material`, whose geometry lies along −z from the tip at the origin, follow the needle. */
  applyTo(material: MeshPhongMaterial): void {
    material.onBeforeCompile = (shader) => {
      shader.uniforms.deflections = {value: this.deflections};
      shader.uniforms.shaftMm = {value: this.lengthMm};
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', `#include <common>\n${DECLARATIONS}`)
        .replace('#include <beginnormal_vertex>', `#include <beginnormal_vertex>
          vec3 slope;
          vec3 deflection = deflectionAt(position.z, slope);
          objectNormal.z -= dot(objectNormal.xy, slope.xy);`)
        .replace('#include <begin_vertex>', '#include <begin_vertex>\n          transformed += deflection;');
    };
  }

  show(needle: Needle): void {
    const points = needle.shape?.points;
    const p = needle.pose;
    const last = points ? points.length / 3 - 1 : 0;
    for (let k = 0; k < STATIONS; ++k) {
      const deflection = this.deflections[k]!;
      if (!points) {
        deflection.set(0, 0, 0);
        continue;
      }
      const place = (k * last) / (STATIONS - 1);
      const i = Math.min(Math.floor(place), last - 1);
      const share = place - i;
      const from = (axis: number): number =>
        (1 - share) * points[3 * i + axis]! + share * points[3 * i + 3 + axis]! - p[4 * axis + 3]!;
      const x = from(0);
      const y = from(1);
      const z = from(2);
      const straight = this.lengthMm * (k / (STATIONS - 1) - 1);
      deflection.set(p[0]! * x + p[4]! * y + p[8]! * z, p[1]! * x + p[5]! * y + p[9]! * z,
                     p[2]! * x + p[6]! * y + p[10]! * z - straight);
    }
  }
}
