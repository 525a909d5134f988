// State of one simulation, received from a daemon or read from a recording. Scene, panels and charts display it.
import {FrameAssembler} from '../protocol/assembler.js';
import type {Frame} from '../protocol/frame.js';
import type {Scanner, UltrasoundImage} from '../protocol/image.js';
import {ScannerArray} from '../protocol/image.js';
import type {Message} from '../protocol/message.js';
import {plannedSeeds, shownPlan, type Plan} from '../protocol/plan_message.js';
import type {PlannedSeed, SceneMessage} from '../protocol/scene_message.js';
import {EventKind, type Dose, type ServerError, type ServerEvent, type State, type Welcome} from '../protocol/server_messages.js';
import type {Topology} from '../protocol/topology.js';
import {History} from './history.js';
import {Rate, Recent} from './rates.js';

const MOST_EVENTS = 100;

export interface LoggedEvent extends ServerEvent {
  timeS: number;
}

export class Session {
  welcome: Welcome | null = null;
  topology: Topology | null = null;
  scene: SceneMessage | null = null;
  /** In use; null: not sent, SCENE's then is. */
  plan: Plan | null = null;
  frame: Frame | null = null;
  state: State | null = null;
  dose: Dose | null = null;
  scanner: Scanner | null = null;
  /** The newest of each array that the scanner shows. */
  readonly images = new Map<number, UltrasoundImage>();
  readonly assembler = new FrameAssembler();
  history = new History();
  events: LoggedEvent[] = [];

  /** Incremented whenever the item is replaced; displays compare them to update. */
  readonly versions = {topology: 0, scene: 0, plan: 0, seeds: 0, dose: 0, events: 0, frame: 0, images: 0};
  /** Points changed since they were last drawn: [first, end). */
  private changedFirst = Infinity;
  private changedEnd = 0;

  frames = 0;
  /** Deadlines that the daemon had missed by the first frame. */
  missedBefore = 0;
  refusedFrames = 0;
  readonly snapshotRate = new Rate();
  readonly tickRate = new Rate();
  readonly byteRate = new Rate();
  readonly imageRate = new Rate();
  /** From the mesh's publishing by the server to its arrival here, ms. */
  readonly meshAge = new Recent();

  /** Storage for the points of a new topology: a buffer of the scene, which sets it. */
  storage: (topology: Topology) => Float32Array = (topology) => new Float32Array(topology.restPositions.length);
  /** False for a recording: its charts are filled from the index, not during playback. */
  recordsHistory = true;

  private firstStampNs = NaN;
  /** When the newest image came. */
  imagesMs = 0;
  private arrivedMs = 0;
  /** Of the newest frame, from its publishing to its arrival, ms; 0: not known. */
  transitMs = 0;

  /** Clears all but the mesh, which the next TOPOLOGY replaces if it differs. */
  forget(): void {
    this.frame = null;
    this.state = null;
    this.dose = null;
    this.forgetImages();
    this.scene = null;
    this.plan = null;
    this.events = [];
    this.history = new History();
    this.firstStampNs = NaN;
    for (const key of Object.keys(this.versions) as (keyof Session['versions'])[]) if (key !== 'topology') this.versions[key] += 1;
  }

  /** Returns '' or why the message breaks the protocol. */
  apply(message: Message): string {
    switch (message.kind) {
      case 'welcome':
        this.welcome = message.body;
        this.frame = null;
        this.forgetImages();
        return '';
      case 'topology':
        return this.applyTopology(message.body);
      case 'scene':
        this.scene = message.body;
        this.versions.scene += 1;
        return '';
      case 'plan':
        this.plan = this.scene ? shownPlan(message.body, this.scene.template) : message.body;
        this.versions.plan += 1;
        this.versions.seeds += 1;
        return '';
      case 'frame':
        return this.applyFrame(message.body, message.header.stampNs);
      case 'state':
        this.state = message.body;
        if (this.recordsHistory) recordState(this.history, message.body, this.timeS(message.header.stampNs));
        return '';
      case 'event':
        this.log(message.body, this.timeS(message.header.stampNs));
        return '';
      case 'error':
        this.logError(message.body, this.timeS(message.header.stampNs));
        return '';
      case 'dose':
        this.dose = message.body;
        this.versions.dose += 1;
        return '';
      case 'image':
        if (!this.isShown(message.body.array)) return '';
        this.images.set(message.body.array, message.body);
        this.imagesMs = performance.now();
        this.imageRate.add(this.imagesMs);
        this.versions.images += 1;
        return '';
      case 'scanner':
        this.scanner = message.body;
        for (const array of this.images.keys()) if (!this.isShown(array)) this.images.delete(array);
        this.versions.images += 1;
        return '';
      default:
        return '';
    }
  }

  /** The holes of the plan in use. */
  plannedHoles(): string[] {
    return (this.plan?.needles ?? this.scene?.plannedNeedles ?? []).map((needle) => needle.hole);
  }

  /** Whether the plan has catheters and no seeds. */
  get isHdr(): boolean {
    return this.scene !== null && this.scene.plannedNeedles.length > 0 && this.scene.plannedSeeds.length === 0 && this.plan === null;
  }
  /** Needles in the tissue. */
  get cathetersIn(): number {
    return (this.frame?.needles ?? []).filter(({present, contact}) => present && (contact === 2 || contact === 3)).length;
  }

  /** The planned seeds in use, by their numbers. */
  plannedSeeds(): Map<number, PlannedSeed> {
    if (this.plan && this.scene) return plannedSeeds(this.plan, this.scene.template);
    return new Map((this.scene?.plannedSeeds ?? []).entries());
  }

  /** How far a place is beyond the template along the needles, mm: the depth of everything that is shown. Null: there is no template. */
  depthBeyondTemplate(place: ArrayLike<number>): number | null {
    return this.scene ? place[2]! - this.scene.template.origin[2] : null;
  }

  /** The box of the surface at rest, mm. */
  surfaceBox(): {low: number[]; high: number[]} {
    if (this.box?.of === this.topology) return this.box;
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    const {topology} = this;
    for (let i = 0; i < 3 * (topology?.surfaceVertexCount ?? 0); ++i) {
      low[i % 3] = Math.min(low[i % 3]!, topology!.restPositions[i]!);
      high[i % 3] = Math.max(high[i % 3]!, topology!.restPositions[i]!);
    }
    this.box = {low, high, of: topology};
    return this.box;
  }
  private box: {low: number[]; high: number[]; of: Topology | null} | null = null;

  /** How old the frame shown is, ms: from its publishing by the server, as far as that is known, else from its arrival. */
  ageMs(nowMs: number): number {
    return nowMs - this.arrivedMs + Math.max(0, this.transitMs);
  }

  forgetImages(): void {
    this.scanner = null;
    this.images.clear();
    this.versions.images += 1;
  }

  /** An image that was on its way when the array was changed is not shown any more. */
  private isShown(array: number): boolean {
    const chosen = this.scanner?.array;
    if (chosen === ScannerArray.Biplane) return array === ScannerArray.Transverse || array === ScannerArray.Sagittal;
    return chosen === undefined || chosen === array;
  }

  /** Points that changed since the last call, [first, end); null: none. */
  takeChangedPoints(): [number, number] | null {
    if (this.changedFirst >= this.changedEnd) return null;
    const range: [number, number] = [this.changedFirst, this.changedEnd];
    this.changedFirst = Infinity;
    this.changedEnd = 0;
    return range;
  }

  allPointsChanged(): void {
    this.changedFirst = 0;
    this.changedEnd = this.assembler.positions.length / 3;
    this.versions.seeds += 1;
  }

  /** Seconds since this session's first message, on the server's clock. */
  timeS(stampNs: number): number {
    if (Number.isNaN(this.firstStampNs)) this.firstStampNs = stampNs;
    if (stampNs < this.firstStampNs) {  // another daemon's clock
      this.history.clear();
      this.firstStampNs = stampNs;
    }
    return (stampNs - this.firstStampNs) / 1e9;
  }

  private applyTopology(topology: Topology): string {
    const same = this.topology?.hash === topology.hash && this.assembler.positions.length === topology.restPositions.length;
    const refusal = this.assembler.start(topology, same ? this.assembler.positions : this.storage(topology));
    if (refusal) return refusal;
    this.topology = topology;
    this.dose = null;
    this.versions.dose += 1;
    if (!same) this.versions.topology += 1;
    this.allPointsChanged();
    return '';
  }

  private applyFrame(frame: Frame, stampNs: number): string {
    const refusal = this.assembler.apply(frame);
    if (refusal) {
      this.refusedFrames += 1;
      return refusal;
    }
    const timeS = this.timeS(stampNs);
    const before = this.frame;
    for (let i = 0; i < frame.ranges.length; i += 2) {
      this.changedFirst = Math.min(this.changedFirst, frame.ranges[i]!);
      this.changedEnd = Math.max(this.changedEnd, frame.ranges[i]! + frame.ranges[i + 1]!);
    }
    if (frame.full || (frame.seeds && frame.seeds.entries.length > 0)) this.versions.seeds += 1;
    if (before && frame.seeds === null && this.assembler.seeds.length === 0 && this.dose && this.dose.seeds > 0) {  // the daemon was reset
      this.dose = null;
      this.versions.dose += 1;
    }
    if (this.frames === 0) this.missedBefore = frame.overruns;
    this.frame = frame;
    this.frames += 1;
    this.versions.frame += 1;
    const nowMs = performance.now();
    this.arrivedMs = nowMs;
    this.snapshotRate.add(nowMs);
    if (before && frame.tick > before.tick) this.tickRate.add(nowMs, frame.tick - before.tick);
    if (this.recordsHistory) {
      recordFrame(this.history, frame, timeS);
      this.history.forgetOld();
    }
    return '';
  }

  private log(event: ServerEvent, timeS: number): void {
    if (event.kind === EventKind.Reset && this.recordsHistory) this.history.clear();
    this.events.push({...event, timeS});
    if (this.recordsHistory && this.events.length > MOST_EVENTS) this.events.shift();
    this.versions.events += 1;
  }

  private logError(error: ServerError, timeS: number): void {
    this.log({kind: EventKind.Warning, needle: 0, tick: this.frame?.tick ?? 0, text: error.text}, timeS);
  }
}

export function recordFrame(history: History, frame: Frame, timeS: number): void {
  history.nowS = timeS;
  for (const needle of frame.needles) {
    const forces = needle.present ? needle.forces : null;
    history.needle(needle.id).push(timeS, forces?.tipDepthMm ?? NaN, forces?.axialN ?? NaN, forces?.lateralN ?? NaN, needle.pose[11] ?? NaN);
  }
  const certificate = frame.certificate;
  history.det.push(timeS, certificate?.vertexDet ?? NaN, certificate?.detBound ?? NaN);
}

export function recordState(history: History, state: State, timeS: number): void {
  if (state.tickMs.count > 0) history.ticks.push(timeS, state.tickMs.p50, state.tickMs.p99);
}
