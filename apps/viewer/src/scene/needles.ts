// The needles: shaft with a mark every centimetre, bevelled tip, hub. Each is placed by its pose and bent by its shape; nothing
// is uploaded. The probe comes as one more of them.
import {BufferAttribute, Color, CylinderGeometry, Group, LatheGeometry, Mesh, MeshPhongMaterial, Vector2} from 'three';
import type {Needle} from '../protocol/frame.js';
import type {SceneProbe} from '../protocol/scene_message.js';
import {NeedleBend} from './needle_bend.js';

const STEEL = new Color('#c9d3de');
const MARK = new Color('#42566e');

export class Needles {
  readonly group = new Group();
  private readonly bends: (NeedleBend | null)[] = [];
  private readonly hubMaterial = new MeshPhongMaterial({color: '#e8a33d', shininess: 30});
  private lengthMm = 200;
  private diameterMm = 1.27;
  private probe: SceneProbe | null = null;

  /** Dimensions from SCENE; until it arrives those of an 18 G needle, and no probe. */
  setSize(lengthMm: number, diameterMm: number, probe: SceneProbe | null): void {
    if (lengthMm === this.lengthMm && diameterMm === this.diameterMm && JSON.stringify(probe) === JSON.stringify(this.probe)) return;
    this.lengthMm = lengthMm;
    this.diameterMm = diameterMm;
    this.probe = probe;
    for (const needle of [...this.group.children]) {
      needle.traverse((part) => (part as Mesh).geometry?.dispose());
      ((needle.children[0] as Mesh).material as MeshPhongMaterial).dispose();
      needle.removeFromParent();
    }
    this.bends.length = 0;
  }

  show(needles: readonly Needle[]): void {
    while (this.group.children.length < needles.length)
      this.group.add(this.group.children.length === this.probe?.needle ? this.makeProbe(this.probe) : this.make());
    this.group.children.forEach((object, i) => {
      const needle = needles[i];
      object.visible = needle?.present ?? false;
      if (!needle?.present) return;
      const p = needle.pose;
      this.bends[i]?.show(needle);
      object.matrix.set(p[0]!, p[1]!, p[2]!, p[3]!, p[4]!, p[5]!, p[6]!, p[7]!, p[8]!, p[9]!, p[10]!, p[11]!, 0, 0, 0, 1);
    });
  }

  private make(): Group {
    const needle = new Group();
    needle.matrixAutoUpdate = false;
    const bend = new NeedleBend(this.lengthMm);
    this.bends.push(bend);
    const material = new MeshPhongMaterial({vertexColors: true, shininess: 90, specular: 0x777777});
    bend.applyTo(material);
    const steel = new Mesh(shaft(this.lengthMm, this.diameterMm / 2), material);
    steel.frustumCulled = false;  // its bounds are those of the straight shaft
    needle.add(steel);
    const hub = new Mesh(new CylinderGeometry(2.6, 3.2, 12, 24), this.hubMaterial);
    hub.rotation.x = Math.PI / 2;
    hub.position.z = -this.lengthMm - 6;
    needle.add(hub);
    return needle;
  }

  private makeProbe(probe: SceneProbe): Group {
    const group = new Group();
    group.matrixAutoUpdate = false;
    this.bends.push(null);
    const material = new MeshPhongMaterial({color: '#e8ecf0', shininess: 60, transparent: true, opacity: 0.55});
    const radius = probe.diameterMm / 2;
    const profile: Vector2[] = [];
    for (let k = 0; k <= 16; ++k) {
      const angle = (k * Math.PI) / 32;
      profile.push(new Vector2(radius * Math.sin(angle), radius * (Math.cos(angle) - 1)));
    }
    profile.push(new Vector2(radius, -probe.lengthMm));
    const geometry = new LatheGeometry(profile, 48);
    geometry.rotateX(Math.PI / 2);  // the lathe's axis is y
    group.add(new Mesh(geometry, material));
    return group;
  }
}

/** Along −z from the tip at the origin. */
function shaft(lengthMm: number, radius: number): LatheGeometry {
  const profile: {radius: number; z: number; mark: boolean}[] = [{radius: 0, z: 0, mark: false}, {radius, z: -4 * radius, mark: false}];
  for (let cm = 10; cm < lengthMm; cm += 10) {
    const wide = cm % 50 === 0 ? 1.2 : 0.5;
    for (const [z, mark] of [[cm - wide, false], [cm - wide, true], [cm + wide, true], [cm + wide, false]] as const)
      profile.push({radius, z: -z, mark});
  }
  profile.push({radius, z: -lengthMm, mark: false});
  const segments = 16;
  const geometry = new LatheGeometry(profile.map((point) => new Vector2(point.radius, point.z)), segments);
  const colours = new Float32Array(3 * profile.length * (segments + 1));
  for (let i = 0; i < colours.length / 3; ++i) (profile[i % profile.length]!.mark ? MARK : STEEL).toArray(colours, 3 * i);
  geometry.setAttribute('color', new BufferAttribute(colours, 3));
  geometry.rotateX(Math.PI / 2);  // the lathe's axis is y
  return geometry;
}
