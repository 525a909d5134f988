// The volume study at the console: outlining on the screens, buttons and keys, and the score.
import type {Session} from '../model/session.js';
import {MISSED, type Contour} from '../protocol/contour.js';
import type {UltrasoundImage} from '../protocol/image.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, figure, setDisabled, setText, toast} from '../ui/dom.js';
import {toPixel, type Outline, type Pixel} from './geometry.js';
import type {Screen} from './screen.js';
import {VolumeStudy, closedCurve} from './volume_study.js';

const NUDGE_MM = 0.5;
const FINE_MM = 0.1;  // with Shift
const SAME_PLANE_MM = 0.5;

export class StudyPanel {
  readonly study = new VolumeStudy();
  isOn = false;
  /** The daemon's answer to the last study sent. */
  result: Contour | null = null;
  private isWaiting = false;
  private changes = 0;
  /** The topology whose outlines were looked for, and the version that was kept. */
  private restoredFor = 0n;
  private keptVersion = 0;

  constructor(private readonly live: LiveConnection, private readonly session: Session, screens: Iterable<Screen>,
              private readonly freeze: (frozen: boolean) => void) {
    byId('us-outline').addEventListener('click', () => this.toggle());
    byId('us-undo').addEventListener('click', () => this.onImage((image) => this.study.undo(image)));
    byId('us-delete').addEventListener('click', () => this.onImage((image) => this.study.remove(image, this.depthMm)));
    byId('us-discard').addEventListener('click', () => this.onImage((image) => this.study.discard(image, this.depthMm)));
    byId('us-finish').addEventListener('click', () => this.finish());
    addEventListener('pagehide', () => this.keep());  // what was drawn since the last update
    for (const screen of new Set(screens)) {
      screen.editor = {
        press: (image, at, reach) => this.press(image, at, reach),
        drag: (image, at) => this.study.drag(image, at),
        release: () => this.study.release(),
      };
      screen.canvas.addEventListener('keydown', (event) => this.key(event, screen.shownImage));
    }
  }

  /** Changes whenever the outlines over the images do. */
  get version(): number {
    return this.study.version + this.changes;
  }

  toggle(): void {
    this.isOn = !this.isOn;
    this.changes += 1;
    if (this.isOn && !this.session.scanner?.frozen) this.freeze(true);
  }

  /** A stepper's click while outlining: the next slice is looked for in a live image. */
  beforeStep(): void {
    if (this.isOn && this.session.scanner?.frozen) this.freeze(false);
  }

  outlineOn(image: UltrasoundImage): Outline {
    const {points, selected} = this.study.handles(image);
    return {points: this.isOn ? points : [], selected, curve: closedCurve(points), truth: this.truthOn(image)};
  }

  finish(): void {
    const outlines = this.study.outlines();
    if (outlines.length === 0) return toast('Outline a slice first: three points or more around the gland.', true);
    this.isWaiting = true;
    this.live.sendContour(outlines);
  }

  onAnswer(answer: Contour): void {
    this.isWaiting = false;
    this.result = answer;
    this.changes += 1;
    this.show();
  }

  onError(): void {
    this.isWaiting = false;
  }

  /** A recording has no study. */
  forget(): void {
    this.restoredFor = 0n;  // those of the daemon come back with it
    this.study.clear();
    this.keptVersion = this.study.version;
    this.result = null;
    this.isWaiting = false;
    this.changes += 1;
    this.show();
  }

  update(): void {
    this.keep();
    const may = this.live.mayControl;
    const image = this.frozenImage;
    const slice = image && this.study.sliceOf(image);
    byId('us-outline').setAttribute('aria-pressed', String(this.isOn));
    setDisabled('us-outline', !may || !this.session.scanner);
    for (const id of ['us-delete', 'us-discard']) setDisabled(id, !this.isOn || !slice);
    setDisabled('us-undo', !this.isOn || !image);
    setDisabled('us-finish', !may || this.isWaiting || this.study.slices.length === 0);
    const count = this.study.slices.length;
    setText(byId('us-slices'), count ? `${count} slice${count > 1 ? 's' : ''}` : '');
    setText(byId('us-study-note'), this.isWaiting ? 'Scoring…' : this.isOn ? this.hint(image) : '');
  }

  /** Outlines stay when the page is loaded again: in this tab, for this tissue, as long as the daemon's ticks go on. */
  private keep(): void {
    const {topology, frame} = this.session;
    if (!topology || !frame) return;
    const key = `brachy-outlines ${topology.hash.toString(16)}`;
    if (this.restoredFor !== topology.hash) {
      this.restoredFor = topology.hash;
      if (this.study.slices.length === 0) this.study.restore(sessionStorage.getItem(key) ?? '[]');
      this.keptVersion = this.study.version;
    }
    if (this.study.slices.some(({tick}) => tick > frame.tick)) {  // the daemon was reset, or started again, since
      this.study.clear();
      toast('The outlines of an earlier run were let go: the tissue starts again.');
    }
    if (this.keptVersion === this.study.version) return;
    this.keptVersion = this.study.version;
    try {
      sessionStorage.setItem(key, this.study.kept());
    } catch {
      // The tab's storage is full or off: a reload loses them.
    }
  }

  private get depthMm(): number {
    return this.session.scanner?.probeDepthMm ?? NaN;
  }

  /** The image that is outlined: the first that is frozen and not held. */
  private get frozenImage(): UltrasoundImage | null {
    return [...this.session.images.values()].find((image) => image.frozen && !image.held) ?? null;
  }

  private hint(image: UltrasoundImage | null): string {
    if (!image) return 'Step to a slice, and freeze it (F) once the probe stands still.';
    return 'Click points around the gland, or draw along it. Drag a point to move it. + and − go on to the next slice.';
  }

  private press(image: UltrasoundImage, at: Pixel, reach: number): boolean {
    if (!this.isOn) return false;
    if (image.frozen && !image.held) {
      if (!this.study.press(image, at, reach, this.depthMm)) toast('No point there: it would be a spike. Click nearer to the outline, or drag one of its points.');
    } else toast('Freeze the image to outline it (F).');
    return true;
  }

  private onImage(change: (image: UltrasoundImage) => void): void {
    if (this.isOn && this.frozenImage) change(this.frozenImage);
  }

  private key(event: KeyboardEvent, image: UltrasoundImage | null): void {
    if (!this.isOn || !image?.frozen || image.held || event.altKey) return;
    const far = (event.shiftKey ? FINE_MM : NUDGE_MM) / image.spacingMm;
    const nudge = (dx: number, dy: number) => () => this.study.nudge(image, dx * far, dy * far, this.depthMm);
    const undo = event.ctrlKey || event.metaKey;
    if (undo && event.key.toLowerCase() !== 'z') return;
    const act = undo ? () => this.study.undo(image) : {
      ArrowLeft: nudge(-1, 0), ArrowRight: nudge(1, 0), ArrowUp: nudge(0, -1), ArrowDown: nudge(0, 1),
      '[': () => this.study.select(image, -1), ']': () => this.study.select(image, 1),
      Insert: () => this.study.insert(image, this.depthMm), Enter: () => this.study.insert(image, this.depthMm),
      Delete: () => this.study.remove(image, this.depthMm), Backspace: () => this.study.remove(image, this.depthMm),
    }[event.key];
    if (!act) return;
    event.preventDefault();
    event.stopPropagation();  // arrows and brackets mean something else to the page
    act();
  }

  private truthOn(image: UltrasoundImage): Pixel[][] {
    return (this.result?.slices ?? []).flatMap(({pose, points}) => {
      const at = ([x, y]: [number, number]): Pixel & {aside: number} => toPixel(image, [0, 4, 8].map(
        (row) => pose[row]! * x + pose[row + 1]! * y + pose[row + 3]!) as [number, number, number]);
      const pixels = points.map(at);
      return pixels.every(({aside}) => Math.abs(aside) < SAME_PLANE_MM) ? [pixels] : [];
    });
  }

  private show(): void {
    const score = this.result?.score;
    byId('us-study-result').hidden = !score;
    if (!score) return;
    const volume = Number.isFinite(score.volumeErrorPercent)
      ? `, ${figure(score.outlinedCm3)} cm³ outlined, ${figure(score.trueCm3)} true (${score.volumeErrorPercent > 0 ? '+' : ''}${figure(score.volumeErrorPercent)} %)` : '';
    setText(byId('us-study-score'), `Dice ${figure(score.dice, 3)}${volume}; Hausdorff ${figure(score.hausdorffMm)} mm, 95 % ${figure(score.hausdorff95Mm)} mm` +
      `${score.missed ? `; ${score.missed} missed` : ''}${score.beyond ? `; ${score.beyond} beyond the gland` : ''}`);
    byId('us-study-planes').replaceChildren(...score.planes.map((plane) => {
      const row = document.createElement('tr');
      row.append(...[plane.slice === MISSED ? 'missed' : String(plane.slice + 1), figure(plane.offsetMm, 0), figure(plane.outlinedMm2, 0), figure(plane.trueMm2, 0), figure(plane.dice, 3),
        plane.outlinedMm2 && plane.trueMm2 ? figure(plane.hausdorffMm) : '—'].map((text) => Object.assign(document.createElement('td'), {textContent: text})));
      return row;
    }));
  }
}
