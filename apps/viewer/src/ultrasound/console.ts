// The ultrasound panel, as a scanner's console: images, freeze, arrays, knobs, calipers, and the probe's stepper.
import type {Session} from '../model/session.js';
import {ScannerArray, type Scanner, type ScannerRequest, type UltrasoundImage} from '../protocol/image.js';
import {Subscription} from '../protocol/server_messages.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, setDisabled, setText} from '../ui/dom.js';
import {toPixel, type Pixel} from './geometry.js';
import {Screen} from './screen.js';
import {StudyPanel} from './study_panel.js';

const KNOBS = {
  'us-depth': 'depthMm', 'us-gain': 'gainDb', 'us-range': 'dynamicRangeDb', 'us-tgc': 'tgcExtraDbPerCm', 'us-focus': 'focusMm',
} as const;
const UNITS = {'us-depth': 'mm', 'us-gain': 'dB', 'us-range': 'dB', 'us-tgc': 'dB/cm', 'us-focus': 'mm'} as const;
const ARRAYS = [ScannerArray.Transverse, ScannerArray.Sagittal, ScannerArray.Biplane];
const OLD_S = 0.5;
const SEED_REACH_MM = 2.5;  // of a seed's middle from the plane in which it is shown
const SETTLE_MS = 600;  // a knob shows what was asked until the daemon has it

export const STEP_MM = 5;  // of a stepper's click
export const STEP_DEG = 5;

export class UltrasoundConsole {
  readonly screens: ReadonlyMap<number, Screen>;
  readonly outlining: StudyPanel;
  grid = true;
  /** Whether planned seeds and the chosen hole are shown over the images. */
  showsPlan = true;
  chosenHole = '';
  private shown = {images: -1, overlays: 0};
  private overlays = 1;
  private askedMs = -Infinity;

  constructor(private readonly live: LiveConnection, private readonly session: Session) {
    const first = new Screen(byId<HTMLCanvasElement>('us-first'));
    const second = new Screen(byId<HTMLCanvasElement>('us-second'));
    this.screens = new Map([[ScannerArray.Transverse, first], [ScannerArray.EndFire, first], [ScannerArray.Sagittal, second]]);
    this.outlining = new StudyPanel(live, session, this.screens.values(), (frozen) => this.ask({frozen}));
    for (const button of byId('us-array').querySelectorAll('button'))
      button.addEventListener('click', () => this.ask({array: Number(button.dataset['value'])}));
    for (const [id, key] of Object.entries(KNOBS))
      byId<HTMLInputElement>(id).addEventListener('input', (event) => {
        this.askedMs = performance.now();
        const value = Number((event.target as HTMLInputElement).value);
        this.writeKnob(id as keyof typeof KNOBS, value);
        this.ask({[key]: value});
      });
    byId('us-freeze').addEventListener('click', () => this.toggleFreeze());
    byId<HTMLInputElement>('us-grid').addEventListener('change', (event) => this.setGrid((event.target as HTMLInputElement).checked));
    byId('us-clear').addEventListener('click', () => this.clearCalipers());
    for (const button of byId('us-stepper').querySelectorAll('button')) {
      const [mm, deg] = [Number(button.dataset['mm'] ?? 0), Number(button.dataset['deg'] ?? 0)];
      button.addEventListener('click', () => (mm || deg ? this.step(mm, deg) : this.ask({probeDepthMm: 0, probeRotationDeg: 0})));
    }
  }

  get isOpen(): boolean {
    return !byId('panel-ultrasound').hidden;
  }

  ask(request: ScannerRequest): void {
    this.live.setScanner(request);
  }

  toggleFreeze(): void {
    this.ask({frozen: !(this.session.scanner?.frozen ?? false)});
  }

  nextArray(): void {
    const at = ARRAYS.findIndex((array) => array === this.session.scanner?.array);
    this.ask({array: ARRAYS[(at + 1) % ARRAYS.length]!});
  }

  /** Steps the probe from where it was last sent. */
  step(mm: number, deg: number): void {
    const scanner = this.session.scanner;
    if (!scanner) return;
    this.outlining.beforeStep();
    const depth = Math.max(-100, Math.min(100, scanner.probeDepthMm + mm));
    const rotation = Math.max(-180, Math.min(180, scanner.probeRotationDeg + deg));
    this.ask({...(mm ? {probeDepthMm: depth} : {}), ...(deg ? {probeRotationDeg: rotation} : {})});
  }

  setGrid(grid: boolean): void {
    this.grid = grid;
    byId<HTMLInputElement>('us-grid').checked = grid;
    this.overlays += 1;
  }

  clearCalipers(): void {
    for (const screen of this.screens.values()) screen.calipers = [];
    this.overlays += 1;
  }

  /** With every picture: draws images that are new. */
  draw(): void {
    const {images, versions, scene} = this.session;
    const overlays = this.overlays + this.outlining.version;
    if (!this.isOpen || (this.shown.images === versions.images && this.shown.overlays === overlays)) return;
    this.shown = {images: versions.images, overlays};
    for (const image of images.values())
      this.screens.get(image.array)?.show(image, {grid: this.grid, template: scene?.template ?? null, hole: this.chosenHole, seeds: this.showsPlan ? this.seedsOn(image) : [], outline: this.outlining.outlineOn(image)});
  }

  /** Planned seeds in the image's plane that have not fallen. */
  private seedsOn(image: UltrasoundImage): Pixel[] {
    const fallen = new Set(this.session.assembler.seeds.map(({planned}) => planned));
    return [...this.session.plannedSeeds()].flatMap(([number, {position}]) => {
      const at = toPixel(image, position);
      return !fallen.has(number) && Math.abs(at.aside) <= SEED_REACH_MM ? [at] : [];
    });
  }

  /** Some times a second: buttons, knobs and texts. */
  update(): void {
    const {scanner, welcome, images, scene} = this.session;
    const isGranted = ((welcome?.subscription ?? 0) & Subscription.Ultrasound) !== 0;
    const may = this.live.mayControl && scanner !== null;
    const present = [...images.keys()];
    byId('us-first').hidden = !present.some((array) => array !== ScannerArray.Sagittal);
    byId('us-second').hidden = !present.includes(ScannerArray.Sagittal);
    byId('us-screens').classList.toggle('biplane', present.length > 1);
    byId('us-screens').hidden = present.length === 0;
    byId('us-screens').classList.toggle('old', performance.now() - this.session.imagesMs > 1000 * OLD_S && ![...images.values()].some(({frozen}) => frozen));
    setText(byId('us-note'), this.note(isGranted, present.length > 0));
    for (const id of ['us-freeze', ...Object.keys(KNOBS)]) setDisabled(id, !may);
    for (const button of byId('us-array').querySelectorAll('button')) button.disabled = !may;
    this.outlining.update();
    const mayStep = may && !scanner.probeHasDevice;
    for (const button of byId('us-stepper').querySelectorAll('button')) button.disabled = !mayStep;
    if (!scanner) return;
    this.showScanner(scanner);
    setText(byId('us-probe'), scanner.probeHasDevice ? 'a device moves the probe'
      : `${scanner.probeDepthMm >= 0 ? '+' : ''}${scanner.probeDepthMm.toFixed(0)} mm, ${scanner.probeRotationDeg.toFixed(0)}°${scene?.probe && !scanner.probeIsStepped ? ', not yet in' : ''}`);
  }

  private note(isGranted: boolean, hasImage: boolean): string {
    if (this.live.status.phase !== 'open') return 'Images come from a running daemon.';
    if (!isGranted) return this.session.welcome ? 'This daemon makes no ultrasound images: [ultrasound] on is false.' : '';
    if (!hasImage) return 'The first image is being made…';
    const image = [...this.session.images.values()][0]!;
    const silentS = (performance.now() - this.session.imagesMs) / 1000;
    if (silentS > OLD_S && !image.frozen) return `This image is ${silentS.toFixed(1)} s old.`;
    return `${this.session.imageRate.perSecond(performance.now()).toFixed(0)} images/s, tick ${image.tick}, ${image.spacingMm.toFixed(3)} mm a pixel.${this.outlining.isOn ? '' : ' Drag on an image to measure.'}`;
  }

  private showScanner(scanner: Scanner): void {
    for (const button of byId('us-array').querySelectorAll('button'))
      button.setAttribute('aria-pressed', String(Number(button.dataset['value']) === scanner.array));
    byId('us-freeze').setAttribute('aria-pressed', String(scanner.frozen));
    if (performance.now() - this.askedMs < SETTLE_MS) return;
    for (const [id, key] of Object.entries(KNOBS)) this.writeKnob(id as keyof typeof KNOBS, scanner[key]);
  }

  private writeKnob(id: keyof typeof KNOBS, value: number): void {
    byId<HTMLInputElement>(id).value = String(value);
    setText(byId(`${id}-value`), `${+value.toFixed(1)} ${UNITS[id]}`);
  }
}

