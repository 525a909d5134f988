// Exercises that the daemon offers, and the result of the one that its scene belongs to.
import type {Endpoint} from '../transport/endpoint.js';
import {byId, setDisabled, setText} from './dom.js';

const ASK_AGAIN_MS = 400;

interface Offered {
  file: string;
  name: string;
  asks: string;
  passes: string[];
  running: boolean;
}
interface List {
  exercises: Offered[];
  recorded: boolean;
}
type Result = {state: 'scored'; passed: boolean; lines: {text: string; kept: boolean}[]} | {state: 'scoring'} | {state: 'none'; why: string};

export class ExercisePanel {
  /** For tests: what was shown last. */
  list: List = {exercises: [], recorded: false};
  result: Result | null = null;
  private isAsking = false;

  constructor(private readonly endpoint: Endpoint) {
    byId('exercise-check').addEventListener('click', () => void this.check());
  }

  /** Reads the list again, after each connection: another daemon may have other ones. A daemon of an earlier version has none. */
  async load(): Promise<void> {
    const before = this.running?.file;
    this.list = (await this.get<List>('exercises')) ?? {exercises: [], recorded: false};
    if (this.running?.file !== before) this.result = null;
    this.show();
  }

  private get running(): Offered | undefined {
    return this.list.exercises.find((exercise) => exercise.running);
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

  private async get<T>(page: string): Promise<T | null> {
    try {
      const answer = await fetch(`/${page}`, {cache: 'no-store', headers: this.endpoint.authorisation()});
      return answer.ok && answer.headers.get('Content-Type') === 'application/json' ? ((await answer.json()) as T) : null;
    } catch {
      return null;
    }
  }

  private show(): void {
    const {exercises, recorded} = this.list;
    const running = this.running;
    byId('tab-exercise').hidden = exercises.length === 0;
    byId('exercise-running').hidden = !running;
    if (running) {
      setText(byId('exercise-name'), running.name);
      setText(byId('exercise-asks'), running.asks);
      const lines = this.result?.state === 'scored' ? this.result.lines : running.passes.map((text) => ({text, kept: null}));
      byId('exercise-lines').replaceChildren(...lines.map(({text, kept}) => {
        const item = document.createElement('li');
        item.textContent = text;
        item.className = kept === null ? '' : kept ? 'met' : 'missed';
        return item;
      }));
    }
    setDisabled('exercise-check', !recorded || this.result?.state === 'scoring');
    const verdict = byId('exercise-verdict');
    verdict.className = this.result?.state === 'scored' ? (this.result.passed ? 'verdict met' : 'verdict missed') : 'verdict';
    setText(verdict, this.result?.state === 'scored' ? (this.result.passed ? 'Passed so far' : 'Not passed so far')
      : this.result?.state === 'scoring' ? 'Scoring the session…'
      : this.result?.state === 'none' ? this.result.why
      : recorded ? '' : 'No result: start brachyd with --session DIR to record the session.');
    byId('exercise-all').replaceChildren(...exercises.flatMap((exercise) => {
      const [name, asks] = [document.createElement('dt'), document.createElement('dd')];
      name.textContent = exercise.name + (exercise.running ? ' (running)' : '');
      asks.textContent = `${exercise.asks} Passes with: ${exercise.passes.join(', ')}.`;
      return [name, asks];
    }));
  }
}
