// The page: a daemon or a recording feeds a Session; pictures, charts and panels show it.
import 'uplot/dist/uPlot.min.css';
import {DvhPanel, doseNote} from './charts/dvh.js';
import {NeedleCharts} from './charts/needle_charts.js';
import {Session} from './model/session.js';
import {defaultSettings, wantsVolume} from './model/settings.js';
import {Role} from './protocol/server_messages.js';
import {UploadCount, expose} from './probe.js';
import {NeedleDrag} from './scene/drag.js';
import {Gizmo} from './scene/gizmo.js';
import type {View} from './scene/views.js';
import {Viewport} from './scene/viewport.js';
import {Endpoint} from './transport/endpoint.js';
import {LiveConnection} from './transport/live.js';
import {DisplayPanel} from './ui/display.js';
import {Debrief} from './ui/debrief.js';
import {ExercisePanel} from './ui/exercise.js';
import {byId, setText, toast} from './ui/dom.js';
import {HandPanel} from './ui/hand.js';
import {Keyboard} from './ui/keyboard.js';
import {Legend} from './ui/legend.js';
import {setUpDrawers, setUpTabs} from './ui/layout.js';
import {nextStep} from './ui/next_step.js';
import {Roles} from './ui/roles.js';
import {STEP_DEG, STEP_MM, UltrasoundConsole} from './ultrasound/console.js';
import {PlanPanel} from './ui/plan.js';
import {Playback} from './ui/playback.js';
import {SimulationPanel} from './ui/simulation.js';
import {VolumePanel} from './ui/volume_panel.js';
import {ageOfPicture} from './ui/age.js';
import {showAge, showConnection, showCounters, showEvents, showReadouts, showVerdict} from './ui/status.js';

const CHARTS_MS = 100;
const COUNTERS_MS = 500;

const served = location.protocol.startsWith('http');
const endpoint = new Endpoint(served);
const role = new URLSearchParams(location.search).get('role') === 'viewer' ? Role.Viewer : Role.Operator;

const settings = defaultSettings();
const session = new Session();
let shownNeedle = 0;
const live = new LiveConnection(endpoint, role, session);
const viewport = openViewport();
const uploads = new UploadCount(viewport.renderer.getContext() as WebGL2RenderingContext);
const gizmo = new Gizmo(byId<HTMLCanvasElement>('gizmo'));
const charts = new NeedleCharts({forceDepth: byId('c-depth'), forceTime: byId('c-force'), det: byId('c-det'), ticks: byId('c-ticks')});
const dvh = new DvhPanel(byId('c-dvh'), byId('dvh-legend'), byId<HTMLTableElement>('figures'));

const display = new DisplayPanel(settings, () => live.wantVolume(wantsVolume(settings)));
const legend = new Legend(settings, (some) => display.change(some));
const volume = new VolumePanel(endpoint, settings, (some) => display.change(some), (shown) => viewport.setVolume(shown));
const scanner = new UltrasoundConsole(live, session);
const plan = new PlanPanel(live, session);
const exercise: ExercisePanel = new ExercisePanel(endpoint, live, () => hand.release());
const simulation = new SimulationPanel(live, session, () => exercise.list.recorded);
const hand = new HandPanel(endpoint, session, live, settings, () => simulation.plays, () => shownNeedle, (needle) => showNeedle(needle), (hole) => display.change({hole}));
new NeedleDrag(byId<HTMLCanvasElement>('scene'), viewport, hand);
const playback: Playback = new Playback(session, () => {
  hand.release();
  if (playback.freezes) live.feeds = false;
  else live.end();
  exercise.clear();
  volume.clear();
  scanner.outlining.forget();
  if (!byId('panel-plan').hidden) selectTab('needle');
  if (!byId('panel-exercise').hidden && roles.person !== 'trainee') selectTab('needle');
});

const debrief = new Debrief(endpoint, live, playback, settings);

/** Whose forces and depth are shown. */
function showNeedle(needle: number): void {
  shownNeedle = needle;
  byId<HTMLSelectElement>('needle').value = String(needle);
}

function backToLive(): void {
  session.recordsHistory = true;
  session.forget();
  live.feeds = true;
  live.connect();
}
byId('live').addEventListener('click', () => {
  playback.close();
  backToLive();
});
byId('banner').querySelector('button')!.addEventListener('click', () => live.connect());
for (const button of byId('views').querySelectorAll('button'))
  button.addEventListener('click', () => viewport.views.go(button.dataset['view'] as View));
live.onOpen = () => {
  void exercise.load();
  void volume.load();
  if (roles.person === 'teacher') void debrief.load();
};
live.onError = (error) => {
  scanner.outlining.onError();
  plan.onError();
  toast(error.text, true);
};
live.onContour = (answer) => scanner.outlining.onAnswer(answer);

byId<HTMLSelectElement>('needle').addEventListener('change', (event) => showNeedle(Number((event.target as HTMLSelectElement).value)));
setUpDrawers();
const selectTab = setUpTabs((tab) => {
  chartsDueMs = 0;
  live.wantUltrasound(tab === 'ultrasound');
});
const roles = new Roles(() => {
  scanner.showsPlan = !roles.isExamination;
  selectTab(({trainee: 'ultrasound', teacher: 'debrief', research: 'needle'} as const)[roles.person]);
  if (roles.person === 'teacher' && live.status.phase === 'open') void debrief.load();
});
let chartsDueMs = 0;
let countersDueMs = 0;
let beforeMs = performance.now();
let hasMesh = false;

function openViewport(): Viewport {
  try {
    return new Viewport(byId<HTMLCanvasElement>('scene'), session, settings);
  } catch (error) {
    byId('empty').hidden = false;
    byId('empty-open').hidden = true;
    setText(byId('empty-text'), `This browser has no WebGL 2, which the viewer needs: enable hardware acceleration, or use another browser. (${(error as Error).message})`);
    throw error;
  }
}

function animate(nowMs: number): void {
  requestAnimationFrame(animate);
  if (playback.player?.playing) playback.player.advance((nowMs - beforeMs) / 1000);
  beforeMs = nowMs;
  const steady = {...session.versions};
  const shownFrame = drawn.frame !== steady.frame && drawn.topology === steady.topology && drawn.seeds === steady.seeds &&
    drawn.dose === steady.dose && drawn.images === steady.images && drawn.scene === steady.scene && drawn.settings === settings.version;
  drawn = {...steady, settings: settings.version};
  if (viewport.draw(nowMs)) {
    gizmo.draw(viewport.camera);
    uploads.finish(shownFrame);
  }
  if (playback.player) debrief.beside.draw(playback.player.positionS, viewport.camera, nowMs);
  scanner.draw();
  if (!hasMesh && session.frame) {
    hasMesh = true;
    performance.mark('first-mesh');
  }
  playback.update();
  if (nowMs >= chartsDueMs) {
    chartsDueMs = nowMs + CHARTS_MS;
    updateCharts();
  }
  if (nowMs >= countersDueMs) {
    countersDueMs = nowMs + COUNTERS_MS;
    showCounters(live, playback.player, session);
  }
}
let drawn = {...session.versions, settings: -1};
let shownDose: unknown;
let shownScene: unknown;

function updateCharts(): void {
  const ageS = ageOfPicture(live, playback.player, session, performance.now());
  showConnection(live, playback.player, session, ageS);
  showVerdict(session, settings.terms, ageS);
  showAge(ageS);
  showEvents(session, settings.terms);
  simulation.update();
  exercise.update();
  debrief.update();
  scanner.chosenHole = settings.hole;
  if (scanner.isOpen) scanner.update();
  hand.update();
  setText(byId('exercise-next'), roles.isExamination ? '' : nextStep(session, hand.state));
  legend.update(session.scene);
  plan.update();
  display.update(viewport.sliceBox, viewport.scales, session.dose?.surfaceGy != null);
  byId('empty').hidden = session.topology !== null || live.status.phase === 'connecting';
  setText(byId('empty-text'), served
    ? 'The gland appears here as soon as the daemon answers. A recording can be played without a daemon.'
    : 'This page was opened from a file and can play recordings. For a running daemon, open the address that it prints.');
  const ids = session.frame?.needles.map((needle) => needle.id) ?? [];
  byId('needle-row').hidden = ids.length < 2;
  const select = byId<HTMLSelectElement>('needle');
  if (select.options.length !== ids.length) {
    select.replaceChildren(...ids.map((id) => new Option(String(id), String(id))));
    select.value = String(shownNeedle);
  }
  showReadouts(session, shownNeedle);
  const fallen = session.assembler.seeds.length;
  const planned = session.plannedSeeds().size;
  setText(byId('seed-count'), fallen || planned ? `${fallen}${planned ? `/${planned}` : ''}` : '');
  const isHdr = session.isHdr;
  setText(byId('dose-none'), isHdr ? `High dose rate: nothing stays in the tissue. ${session.cathetersIn} of ${session.plannedHoles().length} catheters are in. The dose of its dwell times comes with the first catheter, and is in the report at the end (brachy score).`
    : 'No seed has been dropped yet.');
  if (!byId('panel-needle').hidden) charts.update(session.history, shownNeedle, session.scene?.template.origin[2] ?? null);
  setText(byId('depth-from'), session.scene ? 'beyond the template' : 'in the tissue');
  if (!byId('panel-dose').hidden && (shownDose !== session.dose || shownScene !== session.scene)) {
    shownDose = session.dose;
    shownScene = session.scene;
    dvh.show(session.dose, session.scene?.goals ?? [], session.scene?.colours);
    setText(byId('dose-note'), session.dose ? doseNote(session.dose) : '');
  }
}
dvh.show(null, []);
roles.start();

const toggles = (key: 'wireframe' | 'points' | 'structures' | 'template' | 'plan' | 'clip' | 'field') => () => display.change({[key]: !settings[key]});
const nudge = (dx: number, dy: number, dz: number, seek: number) => () => {
  if (hand.held) hand.move(dx, dy, dz);
  else if (seek) playback.step(seek);
};
const keyboard = new Keyboard([
  {key: ' ', shown: 'Space', does: 'start or stop the script; play or pause', run: () => (playback.player ? playback.toggle() : simulation.togglePlay())},
  {key: 'k', does: 'loop the script', run: () => simulation.toggleLoop()},
  {key: 'n', does: 'take the needle, release it', run: () => hand.toggle()},
  {key: 's', does: 'drop a seed', run: () => hand.press(true), released: () => hand.press(false)},
  {key: 'r', does: 'reset (after confirmation)', run: () => simulation.askReset()},
  {key: 'o', does: 'open a recording', run: () => byId('file').click()},
  {key: '1', does: 'axial view', run: () => viewport.views.go('axial')},
  {key: '2', does: 'sagittal view', run: () => viewport.views.go('sagittal')},
  {key: '3', does: 'coronal view', run: () => viewport.views.go('coronal')},
  {key: '0', does: 'first view', run: () => viewport.views.go('reset')},
  {key: 'c', does: 'colour: plain, displacement, dose', run: () => display.change({colour: ({none: 'displacement', displacement: 'dose', dose: 'none'} as const)[settings.colour]})},
  {key: 'w', does: 'wireframe', run: toggles('wireframe')},
  {key: 'i', does: 'inner points', run: toggles('points')},
  {key: 'g', does: 'organs', run: toggles('structures')},
  {key: 't', does: 'template', run: toggles('template')},
  {key: 'p', does: 'planned seeds', run: toggles('plan')},
  {key: 'x', does: 'clipping plane', run: toggles('clip')},
  {key: 'a', does: 'its next axis', run: () => display.change({clip: true, clipAxis: ((settings.clipAxis + 1) % 3) as 0 | 1 | 2})},
  {key: '[', shown: '[ ]', does: 'move it', run: () => display.change({clipShare: Math.max(0, settings.clipShare - 0.02)})},
  {key: ']', does: '', run: () => display.change({clipShare: Math.min(1, settings.clipShare + 0.02)})},
  {key: 'd', does: 'needle or dose charts', run: () => selectTab(byId('panel-needle').hidden ? 'needle' : 'dose')},
  {key: 'l', does: 'plan', run: () => byId('tab-plan').hidden || selectTab('plan')},
  {key: 'u', does: 'ultrasound; back to the charts', run: () => selectTab(scanner.isOpen ? 'needle' : 'ultrasound')},
  {key: 'e', does: 'exercise', run: () => byId('tab-exercise').hidden || selectTab('exercise')},
  {key: 'f', does: 'freeze the ultrasound', run: () => scanner.toggleFreeze()},
  {key: 'b', does: 'transverse, sagittal, biplane', run: () => scanner.nextArray()},
  {key: 'h', does: 'template holes on the image', run: () => scanner.setGrid(!scanner.grid)},
  {key: 'm', does: 'clear the calipers', run: () => scanner.clearCalipers()},
  {key: 'v', does: 'volume study: outline the gland on frozen images', run: () => scanner.isOpen && scanner.outlining.toggle()},
  {key: '-', shown: '− +', does: 'step the probe 5 mm out, in', run: () => scanner.step(-STEP_MM, 0)},
  {key: '+', does: '', run: () => scanner.step(STEP_MM, 0)},
  {key: '=', does: '', run: () => scanner.step(STEP_MM, 0)},
  {key: ',', shown: ', .', does: 'turn the probe by 5°', run: () => scanner.step(0, -STEP_DEG)},
  {key: '.', does: '', run: () => scanner.step(0, STEP_DEG)},
  {key: 'arrowleft', shown: '← → ↑ ↓', does: 'manual needle 1 mm; 5 s in a recording', run: nudge(1, 0, 0, -5)},
  {key: 'arrowright', does: '', run: nudge(-1, 0, 0, 5)},
  {key: 'arrowup', does: '', run: nudge(0, 1, 0, 0)},
  {key: 'arrowdown', does: '', run: nudge(0, -1, 0, 0)},
  {key: 'pageup', shown: 'PgUp PgDn', does: 'manual needle deeper, out', run: nudge(0, 0, 1, 0)},
  {key: 'pagedown', does: '', run: nudge(0, 0, -1, 0)},
  {key: '?', does: 'this help', run: () => keyboard.help()},
]);

document.addEventListener('visibilitychange', () => {
  if (document.visibilityState === 'visible') live.wake();
  else hand.rest();
});
addEventListener('hashchange', () => {
  if (served && endpoint.takeToken()) live.connect();
});
addEventListener('online', () => live.wake());

expose(session, live, playback, debrief, viewport, uploads, scanner, exercise, volume, hand);
if (served) live.connect();
requestAnimationFrame(animate);
