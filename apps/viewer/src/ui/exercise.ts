// Exercises that the daemon offers, attempts at them, and the result of the one that its scene belongs to.
import type {Endpoint} from '../transport/endpoint.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, element, openPage, setDisabled, setText} from './dom.js';

const ASK_AGAIN_MS = 400;
const KEPT_NAME = 'brachy-trainee';

interface Offered {
  file: string;
  name: string;
  asks: string;
  passes: string[];
  running: boolean;
  /** How often; a daemon of an earlier version does not say. */
  passed?: number;
}
interface List {
  exercises: Offered[];
  recorded: boolean;
  /** Whether an operator may begin one. */
  attempts?: boolean;
}
type Result =
  | {state: 'scored'; passed: boolean; lines: {text: string; kept: boolean}[]; findings?: string[]}
  | {state: 'scoring'}
  | {state: 'none'; why: string};

export class ExercisePanel {
  /** For tests: what was shown last. */
  list: List = {exercises: [], recorded: false};
  result: Result | null = null;
  private isAsking = false;
  private mayBegin = false;

  /** `beforeBegin` is called when another attempt begins: the hand lets go. */
  constructor(private readonly endpoint: Endpoint, private readonly live: LiveConnection, private readonly beforeBegin: () => void) {
    byId('exercise-check').addEventListener('click', () => void this.check());
    byId('exercise-report').addEventListener('click', () => void this.openReport());
    byId('exercise-again').addEventListener('click', () => this.running && this.begin(this.running));
    byId('exercise-following').addEventListener('click', () => this.following && this.begin(this.following));
    const name = byId<HTMLInputElement>('exercise-trainee');
    name.value = sessionStorage.getItem(KEPT_NAME) ?? '';
    name.addEventListener('change', () => sessionStorage.setItem(KEPT_NAME, name.value));
  }

  /** Reads the list again, after each connection: another daemon may have other ones. A daemon of an earlier version has none. */
  async load(): Promise<void> {
    const before = this.running?.file;
    this.list = (await this.get<List>('exercises')) ?? {exercises: [], recorded: false};
    if (this.running?.file !== before || this.list.attempts) this.result = null;  // an attempt begins with each connection
    this.show();
  }

  clear(): void {
    this.list = {exercises: [], recorded: false};
    this.result = null;
    this.show();
  }

  /** Asks for the result of the session so far until it is there. */
  async check(): Promise<void> {
    if (this.isAsking) return;
    this.isAsking = true;
    this.result = {state: 'scoring'};
    this.show();
    do {
      this.result = (await this.get<Result>('exercise-result')) ?? {state: 'none', why: 'The daemon did not answer.'};
      if (this.result.state === 'scoring') await new Promise((resolve) => setTimeout(resolve, ASK_AGAIN_MS));
    } while (this.result.state === 'scoring');
    this.isAsking = false;
    this.show();
  }

  /** Who may begin an attempt changes with the connection's role. */
  update(): void {
    const mayBegin = this.list.attempts === true && this.live.mayControl;
    if (mayBegin === this.mayBegin) return;
    this.mayBegin = mayBegin;
    this.show();
  }

  private get running(): Offered | undefined {
    return this.list.exercises.find((exercise) => exercise.running);
  }

  private get following(): Offered | undefined {
    return this.list.exercises[this.list.exercises.findIndex((exercise) => exercise.running) + 1];
  }

  private begin(exercise: Offered): void {
    this.beforeBegin();
    this.live.beginExercise(exercise.file, byId<HTMLInputElement>('exercise-trainee').value.trim());
  }

  private async openReport(): Promise<void> {
    const answer = await this.endpoint.get('exercise-report');
    if (answer?.ok) openPage(await answer.text());
  }

  private async get<T>(page: string): Promise<T | null> {
    const answer = await this.endpoint.get(page);
    return answer?.ok && answer.headers.get('Content-Type') === 'application/json' ? ((await answer.json()) as T) : null;
  }

  private show(): void {
    const {exercises, recorded, attempts} = this.list;
    const {running, result} = this;
    byId('tab-exercise').hidden = exercises.length === 0;
    byId('exercise-running').hidden = !running;
    if (running) {
      setText(byId('exercise-name'), running.name);
      setText(byId('exercise-asks'), running.asks);
      const lines = result?.state === 'scored' ? result.lines : running.passes.map((text) => ({text, kept: null}));
      byId('exercise-lines').replaceChildren(...lines.map(({text, kept}) => element('li', text, kept === null ? '' : kept ? 'met' : 'missed')));
    }
    setDisabled('exercise-check', !recorded || result?.state === 'scoring');
    const verdict = byId('exercise-verdict');
    verdict.className = result?.state === 'scored' ? (result.passed ? 'verdict met' : 'verdict missed') : 'verdict';
    setText(verdict, result?.state === 'scored' ? (result.passed ? 'Passed so far' : 'Not passed so far')
      : result?.state === 'scoring' ? 'Scoring the session…'
      : result?.state === 'none' ? result.why
      : recorded ? '' : 'No result: start brachyd with --sessions DIR, or --session DIR, to record the session.');
    byId('exercise-findings').replaceChildren(...(result?.state === 'scored' ? result.findings ?? [] : []).map((text) => element('li', text)));
    byId('exercise-report').hidden = result?.state !== 'scored';
    byId('exercise-again').hidden = !this.mayBegin;
    byId('exercise-following').hidden = !this.mayBegin || !this.following;
    byId('exercise-who').hidden = !this.mayBegin;
    setText(byId('exercise-note'), this.mayBegin ? 'Beginning one starts its scene for everybody who is connected.'
      : attempts ? 'An operator can begin another one.'
      : 'To work on another, restart brachyd with its scene: --config config/exercises/scenes/….toml --sessions DIR.');
    byId('exercise-all').replaceChildren(...exercises.flatMap((exercise) => {
      const name = element('dt', exercise.name + (exercise.running ? ' (running)' : '') + (exercise.passed ? `, passed ${exercise.passed === 1 ? 'once' : `${exercise.passed} times`}` : ''));
      const asks = element('dd', `${exercise.asks} Passes with: ${exercise.passes.join(', ')}.`);
      if (this.mayBegin) {
        const start = element('button', 'Start');
        start.addEventListener('click', () => this.begin(exercise));
        start.setAttribute('aria-label', `Start: ${exercise.name}`);
        asks.append(' ', start);
      }
      return [name, asks];
    }));
  }
}
