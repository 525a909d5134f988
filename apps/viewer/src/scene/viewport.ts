// The 3D view: uploads a Session's state to the graphics card, once for each picture in which something has changed.
import {AmbientLight, Color, DirectionalLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer} from 'three';
import type {Session} from '../model/session.js';
import type {Settings} from '../model/settings.js';
import type {ShownVolume} from '../protocol/volume.js';
import {colourTable, roundUp} from './colours.js';
import {ImagePlanes} from './image_planes.js';
import {MeshBuffer} from './mesh_buffer.js';
import {Needles} from './needles.js';
import {Seeds} from './seeds.js';
import {SLICE_VERTICES, Slice} from './slice.js';
import {Structures, TISSUE} from './structures.js';
import {TemplatePlate} from './template_plate.js';
import {Tissue} from './tissue.js';
import {tissueUniforms} from './tissue_material.js';
import {Views} from './views.js';
import {VolumeSlices} from './volume_slices.js';

export class Viewport {
  readonly camera = new PerspectiveCamera(28, 1, 5, 2000);
  readonly views: Views;
  readonly scene = new Scene();
  readonly renderer: WebGLRenderer;
  pictures = 0;
  buffer: MeshBuffer | null = null;

  private readonly uniforms = tissueUniforms(colourTable());
  private readonly tissue = new Tissue(this.uniforms);
  private readonly slice = new Slice(this.uniforms);
  private readonly structures = new Structures();
  private readonly needles = new Needles();
  private readonly seeds = new Seeds();
  private readonly plate = new TemplatePlate();
  private readonly images = new ImagePlanes();
  private readonly volume = new VolumeSlices();
  private drawn = {topology: 0, scene: 0, plan: 0, seeds: 0, dose: 0, frame: 0, images: 0, settings: -1};
  private slicePlace = '';
  private framed = false;
  private dirty = true;

  constructor(private readonly canvas: HTMLCanvasElement, private readonly session: Session, private readonly settings: Settings) {
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true, powerPreference: 'high-performance'});
    this.renderer.setClearColor(new Color(0), 0);
    const key = new DirectionalLight('#ffffff', 2.2);
    key.position.set(-0.35, 0.6, 0.75);
    this.camera.add(key);
    this.scene.add(this.camera, new AmbientLight('#c8d8f0', 1.1));
    this.scene.add(this.needles.group, this.seeds.group, this.structures.group, this.slice.mesh, this.plate.mesh, this.tissue.group, this.images.group, this.volume.group);
    this.views = new Views(this.camera, canvas, () => this.invalidate());
    session.storage = (topology) => (this.buffer = new MeshBuffer(topology, SLICE_VERTICES)).positions;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  invalidate(): void {
    this.dirty = true;
  }

  /** Takes the place and direction of another view. */
  follow({position, quaternion}: PerspectiveCamera): void {
    if (this.camera.position.equals(position) && this.camera.quaternion.equals(quaternion)) return;
    this.camera.position.copy(position);
    this.camera.quaternion.copy(quaternion);
    this.dirty = true;
  }

  get sliceBox(): {low: number[]; high: number[]} {
    return this.slice.box;
  }

  /** null: there is none. */
  setVolume(volume: ShownVolume | null): void {
    this.volume.build(volume);
    this.drawn.settings = -1;
    this.dirty = true;
  }

  /** Draws if anything has changed. Returns whether it did. */
  draw(nowMs: number): boolean {
    if (this.views.step(nowMs)) this.dirty = true;
    this.takeTopology();
    this.takeScene();
    this.takeSettings();
    this.takeMesh();
    this.takeSeedsAndDose();
    this.takeImages();
    if (!this.dirty || this.canvas.clientWidth === 0) return false;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
    this.pictures += 1;
    return true;
  }

  private takeTopology(): void {
    const {topology, versions} = this.session;
    if (!topology || !this.buffer || this.drawn.topology === versions.topology) return;
    this.drawn.topology = versions.topology;
    this.tissue.build(this.buffer);
    this.slice.build(this.buffer);
    this.slicePlace = '';
    const {low, high} = this.slice.box;
    const centre = new Vector3(...low.map((value, axis) => (value + high[axis]!) / 2));
    if (!this.framed) this.views.frame(centre, 0.5 * Math.hypot(...low.map((value, axis) => high[axis]! - value)));
    this.framed = true;
    this.drawn.dose = this.drawn.settings = -1;
    this.dirty = true;
  }

  private takeScene(): void {
    const {scene, versions} = this.session;
    if (this.drawn.scene === versions.scene) return;
    this.drawn.scene = versions.scene;
    this.drawn.seeds = this.drawn.settings = -1;
    this.structures.build(scene);
    this.tissue.setColour(scene?.colours.get(TISSUE));
    if (!scene) return;
    this.needles.setSize(scene.needleLengthMm, scene.needleDiameterMm, scene.probe);
    this.seeds.setSize(scene.seedLengthMm, scene.seedDiameterMm);
    this.uniforms.mostGy.value = 2 * scene.prescriptionGy;
  }

  private takeSettings(): void {
    const s = this.settings;
    if (this.drawn.plan !== this.session.versions.plan) this.drawn.settings = -1;
    this.drawn.plan = this.session.versions.plan;
    if (this.drawn.settings === s.version || !this.buffer) return;
    this.drawn.settings = s.version;
    const volume = this.buffer.topology.pointCount > this.buffer.topology.surfaceVertexCount;
    this.tissue.setOpacity(s.opacity, !s.hidden.has(TISSUE));
    this.tissue.setWireframe(s.wireframe);
    this.tissue.setPoints(s.points && volume);
    this.uniforms.mode.value = {none: 0, displacement: 1, dose: 2}[s.colour];
    this.structures.show(s.structures, s.hidden);
    this.volume.show(s.volume);
    this.plate.mesh.visible = s.template && this.session.scene !== null;
    if (this.session.scene && this.plate.mesh.visible) this.plate.draw(this.session.scene, this.session.plannedHoles(), s.hole);
    this.seeds.setPlanShown(s.plan);

    this.uniforms.clip.value = s.clip;
    this.uniforms.clipNormal.value.set(0, 0, 0).setComponent(s.clipAxis, s.clipFlipped ? -1 : 1);
    const {low, high} = this.slice.box;
    const offset = low[s.clipAxis]! + s.clipShare * (high[s.clipAxis]! - low[s.clipAxis]!);
    this.uniforms.clipOffset.value = s.clipFlipped ? -offset : offset;
    this.slice.mesh.visible = s.clip && s.field && volume;
    const place = `${s.clipAxis} ${offset}`;
    if (this.slice.mesh.visible && this.slicePlace !== place) {
      this.slice.place(s.clipAxis, offset);
      this.slicePlace = place;
      this.session.allPointsChanged();
    }
    this.dirty = true;
  }

  private takeMesh(): void {
    const {frame, versions} = this.session;
    if (this.drawn.frame !== versions.frame) {
      this.drawn.frame = versions.frame;
      this.needles.show(frame?.needles ?? []);
      this.dirty = true;
    }
    const changed = this.session.takeChangedPoints();
    if (!changed || !this.buffer) return;
    if (this.slice.mesh.visible) this.slice.update();
    this.buffer.upload(...changed, this.slice.mesh.visible);
    this.uniforms.mostMm.value = roundUp(Math.max(this.buffer.mostMm, 1));
    this.dirty = true;
  }

  private takeSeedsAndDose(): void {
    const {assembler, dose, versions} = this.session;
    if (this.drawn.seeds !== versions.seeds) {
      this.drawn.seeds = versions.seeds;
      this.seeds.show(assembler.seeds);
      this.seeds.showPlan(this.session.plannedSeeds(), new Set(assembler.seeds.map((seed) => seed.planned)));
      this.dirty = true;
    }
    if (this.drawn.dose !== versions.dose) {
      this.drawn.dose = versions.dose;
      this.tissue.setDose(dose?.surfaceGy ?? null);
      if (dose) this.uniforms.mostGy.value = 2 * dose.prescriptionGy;
      this.dirty = true;
    }
  }

  private takeImages(): void {
    const {images, versions} = this.session;
    if (this.drawn.images === versions.images) return;
    this.drawn.images = versions.images;
    this.images.show(images);
    this.dirty = true;
  }

  /** Pixels of the page. */
  toScreen(place: Vector3): {x: number; y: number} {
    const box = this.canvas.getBoundingClientRect();
    this.camera.updateMatrixWorld();
    const projected = place.clone().project(this.camera);
    return {x: box.left + ((projected.x + 1) / 2) * box.width, y: box.top + ((1 - projected.y) / 2) * box.height};
  }

  /** The tops of the colour bars, mm and Gy. */
  get scales(): {mostMm: number; mostGy: number} {
    return {mostMm: this.uniforms.mostMm.value, mostGy: this.uniforms.mostGy.value};
  }

  private resize(): void {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement!;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.tissue.setPointSize((height * this.renderer.getPixelRatio()) / (2 * Math.tan((this.camera.fov * Math.PI) / 360)));
    this.dirty = true;
  }
}
