// Urethra, rectum and other structures around the gland, at rest.
import {BufferAttribute, BufferGeometry, DoubleSide, Group, Mesh, MeshPhongMaterial} from 'three';
import type {Structure} from '../protocol/scene_message.js';

const COLOURS: Record<string, string> = {urethra: '#f2c94c', rectum: '#b07a5a'};
const OTHERS = ['#7aa6ff', '#b58cff', '#74d99f', '#ff9eb1'];

export function structureColour(name: string, index: number): string {
  return COLOURS[name] ?? OTHERS[index % OTHERS.length]!;
}

export class Structures {
  readonly group = new Group();

  build(structures: readonly Structure[]): void {
    for (const old of [...this.group.children] as Mesh[]) {
      old.geometry.dispose();
      (old.material as MeshPhongMaterial).dispose();
      old.removeFromParent();
    }
    structures.forEach((structure, i) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(structure.vertices, 3));
      geometry.setIndex(new BufferAttribute(structure.triangles, 1));
      geometry.computeVertexNormals();
      const mesh = new Mesh(geometry, new MeshPhongMaterial({
        color: structureColour(structure.name, i), transparent: true, opacity: 0.42, shininess: 20, side: DoubleSide, depthWrite: false,
      }));
      mesh.renderOrder = 1;
      this.group.add(mesh);
    });
  }
}
