// Seeds: capsules of the source's size, all of a kind in one draw. Planned ones are translucent until they are dropped.
import {CapsuleGeometry, Color, DynamicDrawUsage, Group, InstancedMesh, Matrix4, MeshPhongMaterial, Quaternion, Vector3} from 'three';
import type {Seed} from '../protocol/frame.js';
import type {PlannedSeed} from '../protocol/scene_message.js';

const ALONG = new Vector3(0, 1, 0);  // of a capsule as it is made
const ONE = new Vector3(1, 1, 1);
const CERTIFIED = new Color('#ffd166');
const UNCERTIFIED = new Color('#ff7b5a');
const PLANNED = new Color('#5fd3c6');

export class Seeds {
  readonly group = new Group();
  private dropped: InstancedMesh;
  private planned: InstancedMesh;
  private lengthMm = 4.5;
  private diameterMm = 0.8;
  private readonly droppedMaterial = new MeshPhongMaterial({shininess: 80, emissive: 0x3a2a00});
  private readonly plannedMaterial = new MeshPhongMaterial({transparent: true, opacity: 0.5, depthWrite: false, emissive: 0x0a2a28});
  private readonly matrix = new Matrix4();
  private readonly turn = new Quaternion();
  private readonly place = new Vector3();
  private readonly axis = new Vector3();

  constructor() {
    this.dropped = this.make(16, this.droppedMaterial);
    this.planned = this.make(1, this.plannedMaterial);
  }

  setSize(lengthMm: number, diameterMm: number): void {
    this.lengthMm = lengthMm;
    this.diameterMm = diameterMm;
    this.dropped = this.remake(this.dropped, this.dropped.instanceMatrix.count, this.droppedMaterial);
  }

  /** `fallen`: indices of planned seeds that have been dropped. */
  showPlan(plan: ReadonlyMap<number, PlannedSeed>, fallen: ReadonlySet<number>): void {
    if (plan.size > this.planned.instanceMatrix.count) this.planned = this.remake(this.planned, plan.size, this.plannedMaterial);
    let count = 0;
    plan.forEach((seed, i) => {
      if (!fallen.has(i)) this.set(this.planned, count++, seed.position, seed.axis, PLANNED);
    });
    this.finish(this.planned, count);
  }

  setPlanShown(shown: boolean): void {
    this.planned.visible = shown;
  }

  show(seeds: readonly Seed[]): void {
    const capacity = this.dropped.instanceMatrix.count;
    if (seeds.length > capacity) this.dropped = this.remake(this.dropped, Math.max(seeds.length, 2 * capacity), this.droppedMaterial);
    seeds.forEach((seed, i) => this.set(this.dropped, i, seed.position, seed.axis, seed.certified ? CERTIFIED : UNCERTIFIED));
    this.finish(this.dropped, seeds.length);
  }

  private set(mesh: InstancedMesh, i: number, position: readonly number[], axis: readonly number[], colour: Color): void {
    this.turn.setFromUnitVectors(ALONG, this.axis.fromArray(axis as number[]));
    mesh.setMatrixAt(i, this.matrix.compose(this.place.fromArray(position as number[]), this.turn, ONE));
    mesh.setColorAt(i, colour);
  }

  private finish(mesh: InstancedMesh, count: number): void {
    mesh.count = count;
    mesh.instanceMatrix.needsUpdate = true;
    if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
  }

  private make(capacity: number, material: MeshPhongMaterial): InstancedMesh {
    const radius = this.diameterMm / 2;
    const mesh = new InstancedMesh(new CapsuleGeometry(radius, this.lengthMm - 2 * radius, 4, 12), material, capacity);
    mesh.instanceMatrix.setUsage(DynamicDrawUsage);
    mesh.count = 0;
    mesh.frustumCulled = false;
    this.group.add(mesh);
    return mesh;
  }

  private remake(old: InstancedMesh, capacity: number, material: MeshPhongMaterial): InstancedMesh {
    const mesh = this.make(capacity, material);
    mesh.visible = old.visible;
    old.removeFromParent();
    old.geometry.dispose();
    old.dispose();
    return mesh;
  }
}
