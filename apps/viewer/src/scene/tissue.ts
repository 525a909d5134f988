// The gland: its surface, the wires on it, and the points inside.
import {BufferAttribute, BufferGeometry, Group, LineSegments, Mesh, Points, type ShaderMaterial, type Vector3} from 'three';
import type {MeshBuffer} from './mesh_buffer.js';
import {tissueMaterial, type TissueUniforms} from './tissue_material.js';

const PLAIN: [number, number, number] = [0.80, 0.50, 0.47];

export class Tissue {
  readonly group = new Group();
  private surface: Mesh | null = null;
  private readonly surfaceMaterial: ShaderMaterial;
  private readonly wireMaterial: ShaderMaterial;
  private readonly pointMaterial: ShaderMaterial;
  private readonly wires = new Group();
  private readonly points = new Group();
  private extra: BufferAttribute | null = null;

  constructor(uniforms: TissueUniforms) {
    this.surfaceMaterial = tissueMaterial('SURFACE', uniforms, PLAIN, 0.55);
    this.wireMaterial = tissueMaterial('WIRES', {...uniforms, mode: {value: 0}}, [0.85, 0.92, 1.0], 0.22);
    this.pointMaterial = tissueMaterial('POINTS', uniforms, [0.55, 0.68, 0.85], 1);
    this.group.add(this.wires, this.points);
    this.wires.visible = this.points.visible = false;
  }

  /** A new mesh: the only time that anything is built. */
  build(buffer: MeshBuffer): void {
    const {topology, positionAttribute} = buffer;
    for (const old of [this.surface, ...this.wires.children, ...this.points.children] as (Mesh | null)[]) {
      old?.geometry.dispose();
      old?.removeFromParent();
    }
    const rest = new BufferAttribute(topology.restPositions, 3);
    this.extra = new BufferAttribute(new Float32Array(topology.surfaceVertexCount).fill(-1), 1);

    const geometry = new BufferGeometry();
    geometry.setAttribute('position', positionAttribute);
    geometry.setAttribute('normal', buffer.normalAttribute);
    geometry.setAttribute('rest', rest);
    geometry.setAttribute('extra', this.extra);
    geometry.setIndex(new BufferAttribute(topology.triangles, 1));
    this.surface = new Mesh(geometry, this.surfaceMaterial);
    this.surface.renderOrder = 3;

    const wireGeometry = new BufferGeometry();
    wireGeometry.setAttribute('position', positionAttribute);
    wireGeometry.setAttribute('rest', rest);
    wireGeometry.setIndex(new BufferAttribute(edgesOf(topology.triangles), 1));
    const wires = new LineSegments(wireGeometry, this.wireMaterial);
    wires.renderOrder = 4;

    const pointGeometry = new BufferGeometry();
    pointGeometry.setAttribute('position', positionAttribute);
    pointGeometry.setAttribute('rest', rest);
    pointGeometry.setDrawRange(topology.surfaceVertexCount, topology.pointCount - topology.surfaceVertexCount);
    const points = new Points(pointGeometry, this.pointMaterial);

    for (const object of [this.surface, wires, points]) {
      object.frustumCulled = false;
      object.geometry.boundingSphere = buffer.bounds;
    }
    this.group.add(this.surface);
    this.wires.add(wires);
    this.points.add(points);
  }

  /** Gy at each surface vertex; null: not known. */
  setDose(surfaceGy: Float32Array | null): void {
    if (!this.extra) return;
    const values = this.extra.array as Float32Array;
    for (let i = 0; i < values.length; ++i) values[i] = surfaceGy && !Number.isNaN(surfaceGy[i]) ? surfaceGy[i]! : -1;
    this.extra.needsUpdate = true;
  }

  /** `shown`: else as if it were quite clear. */
  setOpacity(opacity: number, shown: boolean): void {
    this.surfaceMaterial.uniforms['opacity']!.value = opacity;
    this.surfaceMaterial.depthWrite = opacity >= 1;
    if (this.surface) this.surface.visible = shown && opacity > 0;
  }

  /** Where it shows neither displacement nor dose; undefined: this page's own. */
  setColour(colour: string | undefined): void {
    const value = colour ? [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255) : PLAIN;
    (this.surfaceMaterial.uniforms['plain']!.value as Vector3).fromArray(value);
  }

  setWireframe(shown: boolean): void {
    this.wires.visible = shown;
  }

  setPoints(shown: boolean): void {
    this.points.visible = shown;
  }

  /** `pixels` for a millimetre at a millimetre's distance. */
  setPointSize(pixels: number): void {
    this.pointMaterial.uniforms['pointSize']!.value = 0.9 * pixels;
  }
}

/** Each edge of the triangles once. */
export function edgesOf(triangles: Uint32Array): Uint32Array {
  const edges: number[] = [];
  for (let t = 0; t < triangles.length; t += 3)
    for (let side = 0; side < 3; ++side) {
      const a = triangles[t + side]!;
      const b = triangles[t + ((side + 1) % 3)]!;
      if (a < b) edges.push(a, b);  // of a closed surface the neighbour has it the other way round
    }
  return new Uint32Array(edges);
}
