// Orbiting camera and the standard views. Patient RAS: +x right, +y front, +z head. The patient's right is on the left, as
// radiology has it: axial from the feet, coronal from the front, sagittal from the patient's left.
import {type PerspectiveCamera, Vector3} from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';

export type View = 'axial' | 'sagittal' | 'coronal' | 'reset';

const FROM: Record<View, [number, number, number]> = {
  axial: [0, 0.0005, -1],  // slightly off the pole: the front is up
  coronal: [0, 1, 0],
  sagittal: [-1, 0, 0],
  reset: [-0.62, 0.60, -0.52],
};
const MOVE_MS = 350;

export class Views {
  readonly controls: OrbitControls;
  private readonly centre = new Vector3();
  private radius = 40;
  private move: {from: Vector3; to: Vector3; fromTarget: Vector3; toTarget: Vector3; startMs: number} | null = null;

  constructor(private readonly camera: PerspectiveCamera, element: HTMLElement, onChange: () => void) {
    camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(camera, element);
    this.controls.enableDamping = false;
    this.controls.minDistance = 15;
    this.controls.maxDistance = 800;
    this.controls.addEventListener('change', onChange);
    this.controls.addEventListener('start', () => (this.move = null));
  }

  /** Centre of the view: the gland. */
  frame(centre: Vector3, radius: number): void {
    this.centre.copy(centre);
    this.radius = radius;
    this.go('reset', true);
  }

  go(view: View, atOnce = false): void {
    const target = this.centre.clone();
    if (view === 'reset') target.z -= 0.28 * this.radius;  // some of the needle, too
    const half = Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect);
    const distance = ((view === 'reset' ? 1.2 : 1.22) * this.radius) / half;
    const place = new Vector3(...FROM[view]).normalize().multiplyScalar(distance).add(target);
    this.move = {from: this.camera.position.clone(), to: place, fromTarget: this.controls.target.clone(), toTarget: target, startMs: performance.now()};
    if (atOnce || matchMedia('(prefers-reduced-motion: reduce)').matches) this.move.startMs -= MOVE_MS;
    this.step(performance.now());
  }

  /** Returns whether the camera is still moving. */
  step(nowMs: number): boolean {
    if (!this.move) return false;
    const {from, to, fromTarget, toTarget, startMs} = this.move;
    const share = Math.min(1, (nowMs - startMs) / MOVE_MS);
    const eased = share * share * (3 - 2 * share);
    this.controls.target.lerpVectors(fromTarget, toTarget, eased);
    const distance = from.distanceTo(fromTarget) * (1 - eased) + to.distanceTo(toTarget) * eased;
    const direction = from.clone().sub(fromTarget).normalize().lerp(to.clone().sub(toTarget).normalize(), eased);
    if (direction.lengthSq() < 1e-6) direction.copy(to).sub(toTarget);
    this.camera.position.copy(direction.normalize().multiplyScalar(distance).add(this.controls.target));
    if (share === 1) this.move = null;
    this.controls.update();
    return true;
  }
}
