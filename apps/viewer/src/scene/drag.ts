// Dragging with a pointer: a drag that starts near the needle moves it, any other rotates the view.
import {type Camera, Plane, Raycaster, Vector2, Vector3} from 'three';
import type {Viewport} from './viewport.js';

const NEAR_PX = {mouse: 30, touch: 48};
const AXIS = new Vector3(0, 0, 1);
const SHAFT_MM = 120;  // length of the shaft that can be dragged

export interface Held {
  held: boolean;
  locked: boolean;
  readonly target: readonly number[];
  move(dx: number, dy: number, dz: number): void;
}

export class NeedleDrag {
  private pointer = -1;
  private readonly before = new Vector3();
  private readonly plane = new Plane();
  private readonly ray = new Raycaster();
  private lastY = 0;
  private readonly camera: Camera;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly viewport: Viewport, private readonly hand: Held) {
    this.camera = viewport.camera;
    // Before the camera's own listeners, which are on the same element.
    canvas.addEventListener('pointerdown', (event) => this.down(event), {capture: true});
    canvas.addEventListener('pointermove', (event) => this.moved(event), {capture: true});
    for (const end of ['pointerup', 'pointercancel'] as const)
      canvas.addEventListener(end, (event) => {
        if (event.pointerId === this.pointer) this.pointer = -1;
      }, {capture: true});
    canvas.addEventListener('wheel', (event) => {
      if (!hand.held) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      hand.move(0, 0, -0.02 * Math.max(-150, Math.min(150, event.deltaY)));
    }, {capture: true, passive: false});
  }

  private down(event: PointerEvent): void {
    if (!this.hand.held || event.button !== 0 || this.pointer >= 0 || !this.near(event)) return;
    event.stopImmediatePropagation();
    this.pointer = event.pointerId;
    this.canvas.setPointerCapture(event.pointerId);
    this.grab(event);
  }

  /** The plane in which the tip follows the pointer. */
  private grab(event: PointerEvent): void {
    const tip = new Vector3(...(this.hand.target as [number, number, number]));
    const look = this.camera.getWorldDirection(new Vector3());
    const along = Math.abs(look.dot(AXIS)) > 0.6;
    // Looking along the needle, across it; else the plane that holds the needle and faces the viewer.
    const normal = along ? AXIS.clone() : look.clone().addScaledVector(AXIS, -look.dot(AXIS)).normalize();
    this.plane.setFromNormalAndCoplanarPoint(normal, tip);
    this.lastY = event.clientY;
    this.cast(event, this.before);
  }

  private moved(event: PointerEvent): void {
    if (event.pointerId !== this.pointer) return;
    event.stopImmediatePropagation();
    const along = Math.abs(this.plane.normal.dot(AXIS)) > 0.5;
    const deeper = event.shiftKey || this.hand.locked;
    if (deeper && along) {  // no direction of the screen is deeper: up is
      this.hand.move(0, 0, (this.lastY - event.clientY) * this.millimetresPerPixel());
      this.lastY = event.clientY;
      this.cast(event, this.before);
      return;
    }
    this.lastY = event.clientY;
    const now = new Vector3();
    if (!this.cast(event, now)) return;
    const way = now.clone().sub(this.before);
    this.hand.move(deeper ? 0 : way.x, deeper ? 0 : way.y, way.z);
    this.before.copy(now);
  }

  private cast(event: PointerEvent, into: Vector3): boolean {
    const box = this.canvas.getBoundingClientRect();
    this.ray.setFromCamera(new Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height), this.camera);
    return this.ray.ray.intersectPlane(this.plane, into) !== null;
  }

  private toScreen(place: Vector3): Vector2 {
    const {x, y} = this.viewport.toScreen(place);
    return new Vector2(x, y);
  }

  private millimetresPerPixel(): number {
    const tip = new Vector3(...(this.hand.target as [number, number, number]));
    const right = new Vector3(1, 0, 0).applyQuaternion(this.camera.quaternion);
    return 1 / Math.max(this.toScreen(tip).distanceTo(this.toScreen(tip.clone().add(right))), 0.5);
  }

  private near(event: PointerEvent): boolean {
    const tip = new Vector3(...(this.hand.target as [number, number, number]));
    const a = this.toScreen(tip);
    const b = this.toScreen(tip.addScaledVector(AXIS, -SHAFT_MM));
    const pointer = new Vector2(event.clientX, event.clientY);
    const shaft = b.clone().sub(a);
    const share = Math.min(1, Math.max(0, pointer.clone().sub(a).dot(shaft) / (shaft.lengthSq() || 1)));
    return pointer.distanceTo(a.addScaledVector(shaft, share)) < (event.pointerType === 'touch' ? NEAR_PX.touch : NEAR_PX.mouse);
  }
}
