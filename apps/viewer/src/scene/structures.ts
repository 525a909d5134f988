// Urethra, rectum and other structures around the gland, at rest.
import {BufferAttribute, BufferGeometry, DoubleSide, Group, Mesh, MeshPhongMaterial} from 'three';
import type {SceneMessage} from '../protocol/scene_message.js';

/** The tissue's name among structures. */
export const TISSUE = 'prostate';

/** Told apart with any kind of colour blindness: by lightness as well as by hue (tests/viewer/colours.test.mjs simulates three). */
const COLOURS: Record<string, string> = {[TISSUE]: '#ff9a85', urethra: '#fbe98a', rectum: '#a5694c'};
const OTHERS = ['#2fb39a', '#d6c2ff', '#b0708f', '#e8f3ff'];

/** The colour of the scene's file, else this page's: by name, or by `index` among the structures. */
export function structureColour(name: string, index: number, given?: ReadonlyMap<string, string>): string {
  return given?.get(name) ?? COLOURS[name] ?? OTHERS[index % OTHERS.length]!;
}

export class Structures {
  readonly group = new Group();

  build(scene: SceneMessage | null): void {
    for (const old of [...this.group.children] as Mesh[]) {
      old.geometry.dispose();
      (old.material as MeshPhongMaterial).dispose();
      old.removeFromParent();
    }
    scene?.structures.forEach((structure, i) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(structure.vertices, 3));
      geometry.setIndex(new BufferAttribute(structure.triangles, 1));
      geometry.computeVertexNormals();
      const mesh = new Mesh(geometry, new MeshPhongMaterial({
        color: structureColour(structure.name, i, scene.colours), transparent: true, opacity: 0.42, shininess: 20, side: DoubleSide, depthWrite: false,
      }));
      mesh.name = structure.name;
      mesh.renderOrder = 1;
      this.group.add(mesh);
    });
  }

  show(all: boolean, hidden: ReadonlySet<string>): void {
    this.group.visible = all;
    for (const mesh of this.group.children) mesh.visible = !hidden.has(mesh.name);
  }
}
