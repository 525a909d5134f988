// Ultrasound images where they are: textured rectangles in the scene.
import {DataTexture, DoubleSide, Group, LinearFilter, Matrix4, Mesh, PlaneGeometry, RedFormat, ShaderMaterial} from 'three';
import type {UltrasoundImage} from '../protocol/image.js';

interface Shown {
  mesh: Mesh<PlaneGeometry, ShaderMaterial>;
  texture: DataTexture;
  image: UltrasoundImage;
}

// Black is clear, so that what lies behind the plane stays visible.
const VERTEX = 'varying vec2 at; void main() { at = uv; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }';
const FRAGMENT = 'uniform sampler2D gray; varying vec2 at; void main() { float g = texture2D(gray, at).r; gl_FragColor = vec4(vec3(g), min(1.0, 0.15 * step(0.002, g) + 1.4 * g)); }';

export class ImagePlanes {
  readonly group = new Group();
  private readonly shown = new Map<number, Shown>();

  show(images: ReadonlyMap<number, UltrasoundImage>): void {
    for (const [array, old] of this.shown) if (!images.has(array)) this.remove(array, old);
    for (const [array, image] of images) {
      const before = this.shown.get(array);
      if (before?.image === image) continue;
      if (before && (before.image.width !== image.width || before.image.height !== image.height)) this.remove(array, before);
      const now = this.shown.get(array) ?? this.add(array, image);
      now.image = image;
      now.texture.image.data = image.pixels;
      now.texture.needsUpdate = true;
      place(now.mesh, image);
    }
  }

  private add(array: number, image: UltrasoundImage): Shown {
    const texture = new DataTexture(image.pixels, image.width, image.height, RedFormat);
    texture.magFilter = texture.minFilter = LinearFilter;
    texture.unpackAlignment = 1;
    const material = new ShaderMaterial({uniforms: {gray: {value: texture}}, vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, side: DoubleSide, depthWrite: false});
    const mesh = new Mesh(new PlaneGeometry(1, 1), material);
    mesh.matrixAutoUpdate = false;
    mesh.renderOrder = 3;
    this.group.add(mesh);
    const shown = {mesh, texture, image};
    this.shown.set(array, shown);
    return shown;
  }

  private remove(array: number, shown: Shown): void {
    shown.mesh.removeFromParent();
    shown.mesh.geometry.dispose();
    shown.mesh.material.dispose();
    shown.texture.dispose();
    this.shown.delete(array);
  }
}

/** The unit square's lower left corner is the texture's first texel, which is the image's first pixel. */
function place(mesh: Mesh, image: UltrasoundImage): void {
  const {pose: X, spacingMm, width, height} = image;
  const [w, h] = [spacingMm * width, spacingMm * height];
  const [x, y] = [w / 2 - spacingMm / 2, h / 2 - spacingMm / 2];  // its middle, from the first pixel's
  const at = (row: number): number => X[4 * row]! * x + X[4 * row + 1]! * y + X[4 * row + 3]!;
  mesh.matrix.copy(new Matrix4(
    X[0]! * w, X[1]! * h, X[2]!, at(0), X[4]! * w, X[5]! * h, X[6]!, at(1), X[8]! * w, X[9]! * h, X[10]!, at(2), 0, 0, 0, 1));
  mesh.matrixWorldNeedsUpdate = true;
}
