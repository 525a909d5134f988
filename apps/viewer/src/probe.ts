// window.brachy: read-only state of this page, for tests and the browser console.
import {Vector3} from 'three';
import type {Session} from './model/session.js';
import {Subscription} from './protocol/server_messages.js';
import type {LiveConnection} from './transport/live.js';
import type {UltrasoundConsole} from './ultrasound/console.js';
import type {Debrief} from './ui/debrief.js';
import type {ExercisePanel} from './ui/exercise.js';
import type {HandPanel} from './ui/hand.js';
import type {Playback} from './ui/playback.js';
import type {VolumePanel} from './ui/volume_panel.js';
import {outline} from './scene/outline.js';
import type {Viewport} from './scene/viewport.js';

/** Counts uploads to the graphics card's buffers, per picture. */
export class UploadCount {
  private buffers = 0;
  private data = 0;
  /** Of the last picture that showed a new snapshot, and the most of any such. */
  last = {updates: 0, rebuilds: 0};
  most = {updates: 0, rebuilds: 0};

  constructor(gl: WebGL2RenderingContext) {
    const update = gl.bufferSubData.bind(gl) as (...all: unknown[]) => void;
    const make = gl.bufferData.bind(gl) as (...all: unknown[]) => void;
    gl.bufferSubData = ((...all: unknown[]) => {
      this.buffers += 1;
      update(...all);
    }) as typeof gl.bufferSubData;
    gl.bufferData = ((...all: unknown[]) => {
      this.data += 1;
      make(...all);
    }) as typeof gl.bufferData;
  }

  /** After a picture. `steady`: nothing but a snapshot's positions was new in it. */
  finish(steady: boolean): void {
    if (steady) {
      this.last = {updates: this.buffers, rebuilds: this.data};
      this.most = {updates: Math.max(this.most.updates, this.buffers), rebuilds: Math.max(this.most.rebuilds, this.data)};
    }
    this.buffers = this.data = 0;
  }
}

export function expose(session: Session, live: LiveConnection, playback: Playback, debrief: Debrief, viewport: Viewport, uploads: UploadCount, scanner: UltrasoundConsole, exercise: ExercisePanel, volume: VolumePanel, hand: HandPanel): void {
  const brachy = {
    get connection() {  // 'connecting', 'open', 'waiting', 'refused' or 'off', with the problem in words
      return {phase: live.status.phase, problem: 'problem' in live.status ? live.status.problem : '', reconnects: live.reconnects};
    },
    get frames() { return session.frames; },
    get sequenceGaps() { return live.sequenceGaps; },
    get refusedFrames() { return session.refusedFrames; },
    get ticks() {  // deadlines missed until this page's first frame, and until now; ticks simulated a second, and how many there should be
      const {frame} = session;
      const perS = frame && frame.tick > 0 ? Math.round(frame.tick / frame.simTimeS) : 0;
      return {missedBefore: session.missedBefore, missed: frame?.overruns ?? 0, perSecond: session.tickRate.perSecond(performance.now()), nominalPerSecond: playback.player ? 0 : perS};
    },
    get tick() { return session.frame?.tick ?? 0; },
    get points() { return session.topology?.pointCount ?? 0; },
    positions: () => session.assembler.positions.slice(),  // 3N, mm, as of `tick`
    get seeds() { return structuredClone(session.assembler.seeds); },
    get needle() {  // X_WN of needle 0, or null
      const needle = session.frame?.needles[0];
      return needle?.present ? Array.from(needle.pose) : null;
    },
    get bend() {  // of needle 0: x y z of points from the hub to the tip, mm, and the tip's distance from where the pose puts it; or null: it is straight
      const shape = session.frame?.needles[0]?.shape;
      return shape ? {points: Array.from(shape.points), tipDeflectionMm: Math.hypot(...shape.tipDeflection)} : null;
    },
    get plannedSeeds() { return session.plannedSeeds().size; },
    get plan() { return structuredClone(session.plan); },
    get depthMm() { return session.frame?.needles[0]?.forces?.tipDepthMm ?? NaN; },
    get plannedNeedles() {  // by the plan at the daemon's start, also catheters
      return (session.scene?.plannedNeedles ?? []).map(({hole, tip}) => ({hole, depthMm: session.depthBeyondTemplate(tip)}));
    },
    get plannedPositions() { return Object.fromEntries(session.plannedSeeds()); },
    get template() { return structuredClone(session.scene?.template ?? null); },
    get planSectionMm() { return Number((document.getElementById('plan-section') as HTMLInputElement).value); },
    glandBoxAt: (depthMm: number) => {  // of the surface's cut at a depth beyond the template, by the lines that are drawn
      const {topology, scene} = session;
      const box = {low: [Infinity, Infinity], high: [-Infinity, -Infinity]};
      if (!topology || !scene) return box;
      const cut = outline(topology, 2, scene.template.origin[2] + depthMm);
      cut.forEach((value, i) => {
        box.low[i % 2] = Math.min(box.low[i % 2]!, value);
        box.high[i % 2] = Math.max(box.high[i % 2]!, value);
      });
      return box;
    },
    get glandDepths() { return [session.surfaceBox().low, session.surfaceBox().high].map((place) => session.depthBeyondTemplate(place)); },
    get depthBeyondTemplateMm() {  // of the tip of the needle that is held, else of needle 0
      const needle = session.frame?.needles.find(({id}) => id === (hand.held ? hand.state.needle : 0));
      return (needle?.present ? session.depthBeyondTemplate([needle.pose[3]!, needle.pose[7]!, needle.pose[11]!]) : null) ?? NaN;
    },
    get handDepthMm() { return session.depthBeyondTemplate(hand.target) ?? NaN; },  // where the needle by hand is to go
    get heldNeedle() { return hand.held ? hand.state.needle : -1; },
    get device() { return session.state?.deviceHolder ?? ''; },
    get model() { return session.state?.controls?.kernel ?? ''; },
    get supportRadiusMm() { return session.state?.controls?.supportRadiusMm ?? NaN; },
    get dose() { return session.dose ? {seeds: session.dose.seeds, atSurface: session.dose.surfaceGy !== null, structures: structuredClone(session.dose.structures), withPlanned: structuredClone(session.dose.withPlanned)} : null; },
    get exercise() { return {offered: structuredClone(exercise.list.exercises), result: structuredClone(exercise.result)}; },
    get structures() { return (session.scene?.structures ?? []).map(({name}) => ({name, colour: session.scene?.colours.get(name) ?? ''})); },
    get subscribesToUltrasound() { return ((session.welcome?.subscription ?? 0) & Subscription.Ultrasound) !== 0; },
    get volume() { return volume.volume ? {...volume.volume, words: volume.volume.words.length} : null; },
    get goals() { return structuredClone(session.scene?.goals ?? []); },
    onScreen: (place: number[]) => viewport.toScreen(new Vector3().fromArray(place)),  // CSS pixels of a place in mm
    get scanner() { return session.scanner ? {...session.scanner} : null; },
    get images() {  // the newest of each array
      return [...session.images.values()].map((image) => ({...image, pose: Array.from(image.pose), pixels: Array.from(image.pixels.subarray(0, 0)), bright: image.pixels.reduce((sum, gray) => sum + (gray > 40 ? 1 : 0), 0)}));
    },
    get calipersMm() {
      return [...scanner.screens].flatMap(([array, screen]) => {
        const image = session.images.get(array);
        return image ? screen.calipers.map(({from, to}) => image.spacingMm * Math.hypot(from.x - to.x, from.y - to.y)) : [];
      });
    },
    get study() {  // the volume study: points of each slice, and the daemon's score
      return {
        on: scanner.outlining.isOn, score: structuredClone(scanner.outlining.result?.score ?? null), truth: structuredClone(scanner.outlining.result?.slices.length ?? 0),
        slices: scanner.outlining.study.slices.map(({number, tick, points, selected}) => ({number, tick, points: points.length, selected})),
      };
    },
    get frozenOnScreen() {  // the tick of the frozen image that the first screen shows; null: it is live
      const image = [...scanner.screens.values()][0]!.shownImage;
      return image?.frozen ? image.tick : null;
    },
    get imagesDrawn() { return Math.max(...[...scanner.screens.values()].map((screen) => screen.drawn)); },
    get pictures() { return viewport.pictures; },
    get uploads() { return {...uploads.last, most: {...uploads.most}}; },  // of a picture with a new snapshot
    get geometries() { return viewport.renderer.info.memory.geometries; },
    get firstPaintMs() { return performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? NaN; },
    get firstMeshMs() { return performance.getEntriesByName('first-mesh')[0]?.startTime ?? NaN; },
    get recording() {
      const player = playback.player;
      return {state: playback.state, opened: playback.opened, positionS: player?.positionS ?? NaN, durationS: player?.durationS ?? NaN, playing: player?.playing ?? false, damage: player?.damage ?? ''};
    },
    get marks() { return playback.marks; },
    get debrief() {
      return {sessions: debrief.choices.map(({listed}) => listed.session), findings: playback.findings.map((finding) => ({...finding, timeS: playback.timeOf(finding)})), sessionS: playback.sessionS, besideS: debrief.beside.player?.positionS ?? NaN};
    },
    get kept() { return {bytes: live.lastMinutes.bytes, seconds: live.lastMinutes.seconds}; },
  };
  Object.assign(window, {brachy: Object.freeze(brachy)});
}
