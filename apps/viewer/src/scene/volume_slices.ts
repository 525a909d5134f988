// Slices of an image volume, at rest, in the scene: a rectangle for each of the patient's planes, which looks its grey up in a
// texture of three dimensions. An oblique volume is shown where it lies.
import {BufferAttribute, BufferGeometry, Data3DTexture, DataUtils, DoubleSide, Group, HalfFloatType, LinearFilter, Matrix4, Mesh, RedFormat, ShaderMaterial, Vector3} from 'three';
import type {VolumeSettings} from '../model/settings.js';
import {boxOf, type ShownVolume} from '../protocol/volume.js';

const VERTEX = 'uniform mat4 toTexture; varying vec3 at; void main() { at = (toTexture * vec4(position, 1.0)).xyz; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }';
// `window`: where black begins, and its width, as shares of the words' range.
const FRAGMENT = /* glsl */ `
precision highp sampler3D;
uniform sampler3D words;
uniform vec2 window;
varying vec3 at;
void main() {
  if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)))) discard;
  gl_FragColor = vec4(vec3(clamp((texture(words, at).r - window.x) / window.y, 0.0, 1.0)), 1.0);
}`;

export class VolumeSlices {
  readonly group = new Group();
  private readonly meshes: Mesh<BufferGeometry, ShaderMaterial>[] = [];
  private texture: Data3DTexture | null = null;
  private volume: ShownVolume | null = null;
  private box = {low: [0, 0, 0], high: [0, 0, 0]};

  build(volume: ShownVolume | null): void {
    for (const mesh of this.meshes.splice(0)) {
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.removeFromParent();
    }
    this.texture?.dispose();
    this.texture = null;
    this.volume = volume;
    if (!volume) return;
    this.box = boxOf(volume);
    const halves = Uint16Array.from({length: 65536}, (_, word) => DataUtils.toHalfFloat(word / 65535));
    this.texture = new Data3DTexture(volume.words.map((word) => halves[word]!), ...volume.size);
    this.texture.format = RedFormat;
    this.texture.type = HalfFloatType;
    this.texture.minFilter = this.texture.magFilter = LinearFilter;
    this.texture.unpackAlignment = 1;
    this.texture.needsUpdate = true;
    const uniforms = {words: {value: this.texture}, toTexture: {value: toTexture(volume)}, window: {value: [0, 1]}};
    for (let axis = 0; axis < 3; ++axis) {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
      geometry.setIndex([0, 1, 2, 2, 1, 3]);
      const mesh = new Mesh(geometry, new ShaderMaterial({uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: DoubleSide}));
      mesh.frustumCulled = false;
      this.meshes.push(mesh);
      this.group.add(mesh);
    }
  }

  show(settings: VolumeSettings): void {
    const volume = this.volume;
    if (!volume) return;
    this.meshes.forEach((mesh, axis) => {
      mesh.visible = settings.planes[axis]!;
      const {low, high} = this.box;
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      const places = mesh.geometry.getAttribute('position') as BufferAttribute;
      for (let corner = 0; corner < 4; ++corner) {
        const place = [0, 0, 0];
        place[axis] = low[axis]! + settings.shares[axis]! * (high[axis]! - low[axis]!);
        place[u] = corner & 1 ? high[u]! : low[u]!;
        place[v] = corner & 2 ? high[v]! : low[v]!;
        places.setXYZ(corner, place[0]!, place[1]!, place[2]!);
      }
      places.needsUpdate = true;
      const range = 65535 * volume.step;
      const least = settings.level - settings.width / 2;
      mesh.material.uniforms['window']!.value = [(least - volume.least) / range, Math.max(settings.width / range, 1e-6)];
    });
  }
}

/** From a place in RAS, mm, to the texture's coordinates: 0 and 1 are the outer faces of the outermost voxels. */
function toTexture(volume: ShownVolume): Matrix4 {
  const {steps: [i, j, k], origin, size} = volume;
  const toWorld = new Matrix4().makeBasis(new Vector3(...i!), new Vector3(...j!), new Vector3(...k!)).setPosition(new Vector3(...origin));
  return new Matrix4().makeScale(1 / size[0], 1 / size[1], 1 / size[2])
    .multiply(new Matrix4().makeTranslation(0.5, 0.5, 0.5)).multiply(toWorld.invert());
}
