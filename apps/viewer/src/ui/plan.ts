// The plan, for operators: the template's holes as seen from the feet, the chosen needle's seeds, and what is left optimised.
import type {Session} from '../model/session.js';
import {PlanKind, SEED_MM, SPACER_MM, type Plan, type PlanNeedle} from '../protocol/plan_message.js';
import {holeName, holeOf, wireHole, type TemplateGrid} from '../protocol/scene_message.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, figure, setDisabled, setText, toast} from './dom.js';
import {PlanBoard} from './plan_board.js';
import {PlanHistory} from './plan_history.js';
import {hasSeedAt, moveSeed, removeSeed} from './train.js';

const DEEPER_MM = 20;  // than the gland: a tip there still leaves seeds in it
const STEP_PX = 16;  // of a drag, for a seed to move on by a spacer

export class PlanPanel {
  /** The hole whose needle is shown; '': none. */
  chosen = '';
  /** The chosen needle's train while a seed is dragged. */
  private draft: string | null = null;
  private shown: unknown[] = [];
  private readonly history = new PlanHistory();
  private readonly board: PlanBoard;

  constructor(private readonly live: LiveConnection, private readonly session: Session) {
    byId('plan-optimise').addEventListener('click', () => {
      if (!this.plan || !this.mayChange) return;
      this.history.asked(this.rest);
      live.changePlan(this.plan.change, null);
    });
    this.board = new PlanBoard(session, (hole) => this.choose(hole), () => {
      this.shown = [];
      this.update();
    });
    byId('plan-undo').addEventListener('click', () => this.step(this.history.undo));
    byId('plan-redo').addEventListener('click', () => this.step(this.history.redo));
    byId('plan-remove').addEventListener('click', () => this.remove());
    byId('plan-add-seed').addEventListener('click', () => this.setTrain(`${this.needle?.train ?? ''}-s`));
    const depth = byId<HTMLInputElement>('plan-depth');
    depth.addEventListener('change', () => this.setDepth(depth));
    depth.addEventListener('keydown', (event) => {
      if (event.key === 'Enter') depth.blur();  // which is a change
      if (event.key === 'Escape') this.showDepth(depth);
    });
    byId('plan-grid').addEventListener('keydown', (event) => this.walk(event));
    byId('panel-plan').addEventListener('keydown', (event) => {
      const key = event.key.toLowerCase();
      if (!(event.ctrlKey || event.metaKey) || !['z', 'y'].includes(key) || event.target === depth) return;
      event.preventDefault();
      this.step(key === 'y' || event.shiftKey ? this.history.redo : this.history.undo);
    });
  }

  private get plan(): Plan | null {
    return this.session.plan;
  }
  private get needle(): PlanNeedle | undefined {
    return this.plan?.needles.find((needle) => needle.hole === this.chosen);
  }
  private get mayChange(): boolean {
    return this.live.mayControl && this.plan !== null && !this.plan.optimising;
  }

  /** Sends the rest with each needle changed or, where `change` gives null, left out. */
  private request(change: (needle: PlanNeedle) => PlanNeedle | null, more: PlanNeedle[] = []): void {
    if (!this.plan || !this.mayChange) return;
    this.history.asked(this.rest);
    this.send([...this.rest.map(change).filter((needle) => needle !== null), ...more]);
  }

  private send(needles: PlanNeedle[]): void {
    const grid = this.session.scene?.template;
    this.live.changePlan(this.plan!.change, needles.map((needle) => (grid ? {...needle, hole: wireHole(needle.hole, grid)} : needle)));
  }

  /** The needles that no seed has left. */
  private get rest(): PlanNeedle[] {
    return this.plan?.needles.filter((needle) => !needle.begun) ?? [];
  }

  /** Takes a change back, or makes it again. */
  private step(from: PlanNeedle[][]): void {
    if (!this.plan || !this.mayChange || from.length === 0) return;
    const begun = new Set(this.plan.needles.filter((needle) => needle.begun).map(({hole}) => hole));
    const needles = from.at(-1)!.filter(({hole}) => !begun.has(hole));
    this.history.stepped(from, this.rest);
    this.send(needles);
  }

  /** The daemon has refused the last request. */
  onError(): void {
    this.history.refused();
  }

  private remove(): void {
    const {needle} = this;
    if (!needle || needle.begun || !this.mayChange) return;
    this.request((other) => (other.hole === needle.hole ? null : other));
    toast(`Needle ${needle.hole} is removed; Undo (Ctrl+Z) brings it back.`);
  }

  private setDepth(field: HTMLInputElement): void {
    const {needle} = this;
    const text = field.value.trim().replace(',', '.');
    const depthMm = text === '' ? NaN : Number(text);
    const [least, most] = this.depthRange();
    if (!needle || depthMm === needle.depthMm) return;
    if (!(depthMm >= least && depthMm <= most)) {
      toast(`${field.value || 'Nothing'} is no depth for ${needle.hole}: ${Math.ceil(least)} to ${Math.floor(most)} mm beyond the template. It stays at ${figure(needle.depthMm)} mm.`, true);
      return this.showDepth(field);
    }
    this.request((other) => (other.hole === needle.hole ? {...other, depthMm} : other));
  }

  private showDepth(field: HTMLInputElement): void {
    if (this.needle) field.value = String(Math.round(10 * this.needle.depthMm) / 10);
  }

  /** Depths of a tip that can leave a seed in the gland, mm beyond the template. */
  private depthRange(): [number, number] {
    const [low, high] = this.board.glandDepths();
    return [low, high + DEEPER_MM];
  }

  private setTrain(train: string): void {
    if (train !== this.needle?.train) this.request((needle) => (needle.hole === this.chosen ? {...needle, train} : needle));
  }

  private choose(hole: string): void {
    this.chosen = hole;
    if (!this.needle) this.request((needle) => needle, [{number: 0, begun: false, firstSeed: 0, depthMm: NaN, hole, train: ''}]);
    this.update();
  }

  update(): void {
    byId('tab-plan').hidden = !this.plan;
    if (this.plan) this.history.update(this.plan.change);
    if (byId('panel-plan').hidden) return;
    const now = [this.plan, this.session.scene, this.session.topology, this.chosen, this.draft, this.mayChange, this.session.dose];
    if (now.every((value, i) => value === this.shown[i])) return;
    this.shown = now;
    const {plan} = this;
    const grid = this.session.scene?.template;
    const left = this.rest;
    setDisabled('plan-undo', !this.mayChange || this.history.undo.length === 0);
    setDisabled('plan-redo', !this.mayChange || this.history.redo.length === 0);
    setText(byId('plan-by'), !plan ? '' : `${plan.kind === PlanKind.File ? 'From the file ' : ''}${plan.by}${plan.change ? `, change ${plan.change}` : ''}: ` +
      `${plan.needles.length} needles, ${left.length} left`);
    setText(byId('plan-note'), plan?.optimising ? 'The rest is being optimised…' : this.live.mayControl ? '' : 'Only an operator can change it.');
    setDisabled('plan-optimise', !this.mayChange || left.length === 0);
    if (grid) this.showGrid(grid);
    this.showNeedle();
    this.showFigures();
  }

  private showGrid(grid: TemplateGrid): void {
    const host = byId('plan-grid');
    this.board.show(grid);
    const needles = new Map(this.plan?.needles.map((needle) => [needle.hole, needle]));
    const first = needles.has(this.chosen) || holeOf(this.chosen, grid) ? this.chosen : holeName({column: 0, row: grid.rows - 1}, grid);
    for (const button of host.querySelectorAll('button')) {
      const hole = button.dataset['hole']!;
      const needle = needles.get(hole);
      const seeds = needle ? needle.train.replaceAll('-', '').length : 0;
      button.className = needle ? (needle.begun ? 'begun' : 'planned') : '';
      button.tabIndex = hole === first ? 0 : -1;
      button.title = needle ? `${hole}: ${seeds} seeds, tip at ${figure(needle.depthMm)} mm${needle.begun ? ', begun' : ''}` : `${hole}: add a needle`;
      button.setAttribute('aria-label', button.title);
      button.setAttribute('aria-pressed', String(hole === this.chosen));
      button.disabled = !needle && !this.mayChange;
    }
  }

  private walk(event: KeyboardEvent): void {
    const grid = this.session.scene?.template;
    const from = grid && holeOf((event.target as HTMLElement).dataset['hole'] ?? '', grid);
    const step = ({ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]} as Record<string, [number, number]>)[event.key];
    if (event.key === 'Delete') this.remove();
    if (!from || !step) return;
    event.preventDefault();
    event.stopPropagation();
    const to = holeName({column: from.column + step[0], row: from.row + step[1]}, grid);
    byId('plan-grid').querySelector<HTMLButtonElement>(`[data-hole="${to}"]`)?.focus();
  }

  private showNeedle(): void {
    const {needle} = this;
    byId('plan-needle').hidden = !needle;
    if (!needle) return;
    const may = this.mayChange && !needle.begun;
    const train = this.draft ?? needle.train;
    setText(byId('plan-hole'), `${needle.hole}${needle.begun ? ', begun: it stays' : ''}`);
    for (const id of ['plan-remove', 'plan-add-seed', 'plan-depth']) setDisabled(id, !may);
    const depth = byId<HTMLInputElement>('plan-depth');
    if (document.activeElement !== depth) this.showDepth(depth);
    const [low, high] = this.board.glandDepths();
    setText(byId('plan-depth-note'), Number.isFinite(low) ? `The gland lies ${figure(low, 0)} to ${figure(high, 0)} mm beyond the template.` : '');
    const host = byId('plan-train');
    const focused = [...host.children].indexOf(document.activeElement!);
    host.replaceChildren(...[...train].map((element, i) => {
      const part = document.createElement(element === 's' ? 'button' : 'span');
      part.style.flexGrow = String(element === 's' ? SEED_MM : SPACER_MM);
      if (element === 's') this.makeSeed(part as HTMLButtonElement, i, may);
      return part;
    }));
    if (hasSeedAt(train, focused)) (host.children[focused] as HTMLElement).focus();
  }

  private makeSeed(button: HTMLButtonElement, at: number, may: boolean): void {
    button.disabled = !may;
    button.title = 'Seed: drag, or ← and →, to move it by a spacer; Delete removes it';
    button.setAttribute('aria-label', `seed ${at + 1}`);
    button.addEventListener('keydown', (event) => {
      const train = this.needle?.train ?? '';
      const to = event.key === 'Delete' ? {train: removeSeed(train, at), at} : moveSeed(train, at, ({ArrowLeft: -1, ArrowRight: 1} as Record<string, number>)[event.key] ?? 0);
      if (to.train === train) return;
      event.preventDefault();
      event.stopPropagation();
      (byId('plan-train').children[to.at] as HTMLElement | undefined)?.focus();
      this.setTrain(to.train);
    });
    button.addEventListener('pointerdown', (event) => this.drag(event, at));
  }

  private drag(down: PointerEvent, at: number): void {
    const from = this.needle?.train ?? '';
    const move = (event: PointerEvent): void => {
      let to = {train: from, at};
      const steps = Math.round((event.clientX - down.clientX) / STEP_PX);
      for (let i = 0; i < Math.abs(steps); ++i) to = moveSeed(to.train, to.at, Math.sign(steps));
      this.draft = to.train;
      this.update();
    };
    const up = (): void => {
      removeEventListener('pointermove', move);
      removeEventListener('pointerup', up);
      removeEventListener('pointercancel', up);
      const train = this.draft;
      this.draft = null;
      if (train !== null) this.setTrain(train);
      this.update();
    };
    addEventListener('pointermove', move);
    addEventListener('pointerup', up);
    addEventListener('pointercancel', up);
  }

  private showFigures(): void {
    const gland = this.session.dose?.withPlanned?.find((structure) => structure.name === 'prostate');
    const urethra = this.session.dose?.withPlanned?.find((structure) => structure.name === 'urethra');
    setText(byId('plan-figures'), gland ? `Delivered and planned: V100 ${figure(gland.v100Percent)} %, V150 ${figure(gland.v150Percent)} %, D90 ${figure(gland.d90Gy)} Gy` +
      `${urethra ? `, urethra D30 ${figure(urethra.d30Gy)} Gy` : ''}` : '');
  }
}
