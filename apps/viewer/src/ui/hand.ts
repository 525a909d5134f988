// The needle by hand: takes the lease, moves the needle, presses the device's button.
import type {Session} from '../model/session.js';
import type {Settings} from '../model/settings.js';
import {holeName, holeOf, type TemplateGrid} from '../protocol/scene_message.js';
import {ErrorCode} from '../protocol/server_messages.js';
import {Device} from '../transport/device.js';
import type {Endpoint} from '../transport/endpoint.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, setDisabled, setText, toast} from './dom.js';
import type {HandState} from './next_step.js';
import {NeedleCourse} from './needle_course.js';
import {SeedDrop} from './seed_drop.js';

const CLEAR_MM = 12;       // in front of the gland, where the needle starts
const BUTTON_MM_S = 20;    // of Advance and Withdraw while they are held
const TAP_MM = 1;

export class HandPanel {
  readonly drop: SeedDrop;
  private readonly course = new NeedleCourse();
  private device: Device | null = null;
  /** Needles to ask for where the one before has a device. */
  private others: number[] = [];
  private pushing = 0;  // −1: out, 1: deeper
  private holes = '';

  constructor(private readonly endpoint: Endpoint, private readonly session: Session, private readonly live: LiveConnection,
              private readonly settings: Settings, private readonly scriptPlays: () => boolean,
              private readonly shownNeedle: () => number, private readonly showNeedle: (needle: number) => void,
              private readonly chooseHole: (hole: string) => void) {
    this.drop = new SeedDrop(session, (text, bad) => toast(text, bad));
    byId('take').addEventListener('click', () => this.toggle());
    byId<HTMLSelectElement>('hole').addEventListener('change', (event) => this.goToHole((event.target as HTMLSelectElement).value));
    whileHeld('drop', () => this.press(true), () => this.press(false));
    whileHeld('advance', () => this.push(1), () => this.push(0));
    whileHeld('withdraw', () => this.push(-1), () => this.push(0));
    addEventListener('blur', () => {  // a release would not be delivered to this page
      this.press(false);
      this.push(0);
    });
  }

  /** Whether the mouse is the needle's device. */
  get held(): boolean {
    return this.device !== null && this.device.needle >= 0;
  }
  get locked(): boolean {
    return this.hole !== null;
  }
  /** Target of the tip, mm. */
  get target(): readonly number[] {
    return this.course.target;
  }

  /** What the next step depends on. */
  get state(): HandState {
    const tip = this.held ? [...this.course.tip] : null;
    return {held: this.held, needle: this.device?.needle ?? 0, hole: this.settings.hole, tip};
  }

  private get hole(): {column: number; row: number} | null {
    return this.session.scene ? holeOf(this.settings.hole, this.session.scene.template) : null;
  }

  /** Whether this page may act as a needle's device: one that only looks on may not. */
  private get mayTake(): boolean {
    return this.live.mayControl && this.session.topology !== null;
  }

  toggle(): void {
    if (this.device) return this.device.end();
    if (!this.mayTake) return;
    // The probe is no needle: it is never asked for.
    const probe = this.session.scene?.probe?.needle;
    const all = (this.session.frame?.needles ?? []).map(({id}) => id).filter((id) => id !== probe);
    const first = this.shownNeedle() === probe ? all[0] ?? 0 : this.shownNeedle();
    this.others = all.filter((id) => id !== first);
    this.ask(first);
  }

  private ask(needle: number): void {
    this.device = new Device(this.endpoint, needle, (elapsedS) => this.pose(elapsedS), (reason, code) => this.ended(reason, code), () => this.granted());
    this.show();
  }

  press(pressed: boolean): void {
    if (!pressed) return this.drop.end();
    if (byId<HTMLButtonElement>('drop').disabled) return;
    if (this.held) {
      const device = this.device!;
      const isOut = (): boolean => this.course.tip[2]! <= this.outsideMm;
      this.drop.begin({press: (down) => device.press(down), tipAt: (sequence) => device.tipAt(sequence), canDraw: true, get isOut() { return isOut(); }}, device.needle);
    } else {
      const needle = this.shownNeedle();
      this.drop.begin({press: (down) => (this.live.press(needle, down), 0), tipAt: () => null, canDraw: false, isOut: false}, needle);
    }
    this.showDrop();
  }

  private push(way: number): void {
    if (way !== 0 && this.pushing === 0) this.move(0, 0, way * TAP_MM);
    this.pushing = way;
  }

  move(dx: number, dy: number, dz: number): void {
    if (!this.held) return;
    if (dz > 0 && this.drop.holds) this.drop.letGo('The needle goes deeper: the stylet was let go.');
    this.course.move(this.locked ? 0 : dx, this.locked ? 0 : dy, dz);
  }

  /** Releases the needle: the page shows a recording. */
  release(): void {
    this.device?.end();
  }

  /** Another window is in front: the needle stays where it is, in the hand. */
  rest(): void {
    this.push(0);
    this.press(false);
    this.course.stop();
  }

  private goToHole(hole: string): void {
    this.chooseHole(hole);
    if (!this.held || !this.hole) return;
    this.drop.letGo();
    this.course.goTo(...this.place(), this.outsideMm);
  }

  /** x and y of the hole, or of the gland's middle. */
  private place(): [number, number] {
    const grid = this.session.scene?.template;
    const {hole} = this;
    if (hole && grid) return [grid.origin[0] + hole.column * grid.spacingMm, grid.origin[1] + hole.row * grid.spacingMm];
    const {low, high} = this.session.surfaceBox();
    return [(low[0]! + high[0]!) / 2, (low[1]! + high[1]!) / 2];
  }

  /** z in front of the gland, where a needle may go from hole to hole. */
  private get outsideMm(): number {
    return this.session.surfaceBox().low[2]! - CLEAR_MM;
  }

  /** A needle that is in the world goes on from where it is; another starts in front of the gland. */
  private granted(): void {
    const {needle} = this.device!;
    this.showNeedle(needle);
    const there = this.session.frame?.needles.find(({id}) => id === needle);
    if (there?.present) {
      this.course.startFrom(there.pose);
      if (this.hole) this.course.goTo(...this.place(), this.outsideMm);
    } else {
      this.course.startAt(...this.place(), this.outsideMm);
    }
    this.show();
  }

  private pose(elapsedS: number): Float64Array {
    const s = Math.min(elapsedS, 0.05);  // a page that slept goes on at the pace of a hand
    this.drop.update();
    const back = this.drop.draw(s, this.course.target);
    if (back > 0) this.course.move(0, 0, -back);
    if (this.pushing) this.move(0, 0, this.pushing * BUTTON_MM_S * s);
    return this.course.next(s);
  }

  private ended(reason: string, code: number): void {
    const wasHeld = this.held;
    this.device = null;
    if (wasHeld && this.session.isHdr) this.showNextCatheter();
    this.drop.stop();
    const next = this.others.shift();
    if (!wasHeld && code === ErrorCode.DeviceBusy && next !== undefined) return this.ask(next);
    if (reason !== 'released') toast(`The needle was not granted or was lost: ${reason}`, true);
    this.show();
  }

  /** A catheter that was let go stays in: the next one is taken. */
  private showNextCatheter(): void {
    const next = (this.session.frame?.needles ?? []).find(({id, present}) => !present && id !== this.session.scene?.probe?.needle);
    if (next) this.showNeedle(next.id);
  }

  private show(): void {
    byId('view').classList.toggle('by-hand', this.held);
    byId('take').setAttribute('aria-pressed', String(this.device !== null));
    setText(byId('take'), this.device ? (this.held ? 'Release the needle' : 'Requesting…') : 'Take the needle');
    this.showDrop();
  }

  private showDrop(): void {
    byId('drop').setAttribute('aria-pressed', String(this.drop.holds));
    setText(byId('hand-note'), this.drop.said || (this.held ? '' : 'Take the needle to move it.'));
  }

  update(): void {
    if (!this.held) this.drop.update();  // the pose's clock does it else
    const scripted = this.live.mayControl && this.scriptPlays();
    setDisabled('take', !this.device && !this.mayTake);
    setDisabled('drop', !this.held && !scripted);
    for (const id of ['advance', 'withdraw']) setDisabled(id, !this.held);
    byId('hand-bar').hidden = !this.live.mayControl;
    this.showDrop();
    this.listHoles();
  }

  private listHoles(): void {
    const scene = this.session.scene;
    const names = scene ? holeNames(scene.template, this.session.plannedHoles()) : [];
    const key = names.join();
    if (key === this.holes) return;
    this.holes = key;
    const planned = new Set(this.session.plannedHoles());
    byId<HTMLSelectElement>('hole').replaceChildren(
      new Option('free', ''), ...names.map((name) => new Option(planned.has(name) ? `${name} · planned` : name, name)));
    byId<HTMLSelectElement>('hole').value = this.settings.hole;
  }
}

/** A button that acts from its press to its release, by pointer or key; a finger that slides off it still holds it. */
function whileHeld(id: string, down: () => void, up: () => void): void {
  const button = byId<HTMLButtonElement>(id);
  const acts = (event: KeyboardEvent): boolean => event.key === 'Enter' || event.key === ' ';
  button.addEventListener('pointerdown', (event) => {
    if (event.button !== 0 || button.disabled) return;
    button.setPointerCapture(event.pointerId);
    down();
  });
  for (const end of ['pointerup', 'pointercancel', 'blur']) button.addEventListener(end, up);
  button.addEventListener('keydown', (event) => {
    if (!acts(event)) return;
    event.preventDefault();
    if (!event.repeat) down();
  });
  button.addEventListener('keyup', (event) => acts(event) && up());
  button.addEventListener('contextmenu', (event) => event.preventDefault());  // a long touch is a press
}

/** The holes, those of the plan first. */
function holeNames(grid: TemplateGrid, planned: string[]): string[] {
  const names = [...new Set(planned)];
  for (let column = 0; column < grid.columns; ++column)
    for (let row = 0; row < grid.rows; ++row) {
      const name = holeName({column, row}, grid);
      if (!names.includes(name)) names.push(name);
    }
  return names;
}
