// The teacher's side: sessions of the daemon's directory to look at, their findings, a second one beside, the last minutes of the
// running one, and the class.
import type {Settings} from '../model/settings.js';
import type {Endpoint} from '../transport/endpoint.js';
import type {LiveConnection} from '../transport/live.js';
import {Beside} from './beside.js';
import {byId, download, element, openPage, setDisabled, setText, toast} from './dom.js';
import {closeDrawers} from './layout.js';
import type {Playback} from './playback.js';
import {clock} from './time.js';
import {showLegend} from './timeline.js';

interface Listed {
  session: string;
  trainee: string;
  task: string;
  began: string;
  passed: boolean | null;
  findings: string[] | null;
  report: string | null;
  recordings: {file: string; bytes: number}[];
  why?: string;
}
/** One recording of a session. */
interface Choice {
  listed: Listed;
  file: string;
  /** "Anna, one needle to a point". */
  name: string;
}

export class Debrief {
  readonly beside: Beside;
  /** For tests: the sessions that are listed. */
  choices: Choice[] = [];
  private opened: Choice | null = null;
  private isOpening = false;
  private asked = false;

  constructor(private readonly endpoint: Endpoint, private readonly live: LiveConnection, private readonly playback: Playback, settings: Settings) {
    this.beside = new Beside(settings);
    showLegend(byId('pb-legend'));
    byId('class-page').addEventListener('click', () => void this.fetched('class.html', async (answer) => openPage(await answer.text())));
    byId('class-csv').addEventListener('click', () => void this.fetched('class.csv', async (answer) => download('class.csv', await answer.text(), 'text/csv')));
    byId('debrief-again').addEventListener('click', () => void this.load());
    byId('debrief-freeze').addEventListener('click', () => void this.freeze());
    byId('debrief-link').addEventListener('click', () => void this.link());
    byId<HTMLSelectElement>('debrief-beside').addEventListener('change', (event) => void this.openBeside((event.target as HTMLSelectElement).value));
    playback.onOpened = () => this.onOpened();
    addEventListener('hashchange', () => this.goToLink());
    this.onOpened();
  }

  /** Reads the list again, and opens what the page's address asks for, once. */
  async load(): Promise<void> {
    const answer = await this.endpoint.get('sessions');
    let note = '';
    this.choices = [];
    if (!answer) note = 'The daemon does not answer.';
    else if (answer.status === 401) note = 'The sessions are for an operator: open the page with that token (#token=…).';
    else if (answer.status === 404) note = 'No sessions are kept: start brachyd with --sessions DIR.';
    else this.choices = choicesOf(((await answer.json()) as {sessions: Listed[]}).sessions);
    if (note === '' && this.choices.length === 0) note = 'No session was recorded yet.';
    setText(byId('debrief-note'), note);
    for (const id of ['class-page', 'class-csv']) setDisabled(id, !answer?.ok);
    this.showChoices();
    const wanted = new URLSearchParams(location.search).get('session');
    const isFirst = !this.asked;
    this.asked = true;
    if (!isFirst || wanted === null) return;
    const choice = this.choices.find(({listed}) => listed.session === wanted);
    if (choice) await this.open(choice);
    else toast(`There is no session ${wanted} here.`, true);
  }

  /** With every picture. */
  update(): void {
    const {lastMinutes} = this.live;
    const isLive = this.playback.player === null;
    byId('debrief-freeze').hidden = !isLive || lastMinutes.seconds <= 0;
    setText(byId('debrief-freeze'), `Freeze and rewind (${clock(lastMinutes.seconds)})`);
    byId('debrief-link').hidden = isLive;
  }

  private showChoices(): void {
    const row = (choice: Choice): HTMLElement => {
      const {listed} = choice;
      const item = element('li', '');
      const button = element('button', choice.name);
      const passed = listed.passed === null ? 'not scored' : listed.passed ? 'passed' : 'not passed';
      button.append(element('small', `${listed.began.replace('T', ' ').replace('Z', '')} · ${passed}`, listed.passed === false ? 'missed' : ''));
      button.setAttribute('aria-pressed', String(this.opened === choice));
      button.title = [listed.session, ...(listed.findings ?? [])].join('\n');
      button.addEventListener('click', () => void this.open(choice));
      item.append(button);
      return item;
    };
    byId('debrief-sessions').replaceChildren(...this.choices.map(row));
    const select = byId<HTMLSelectElement>('debrief-beside');
    const before = select.value;
    select.replaceChildren(new Option('nothing', ''), ...this.choices.map((choice, i) => new Option(`${choice.name} (${choice.listed.session})`, String(i))));
    select.value = this.beside.player ? before : '';
  }

  private async open(choice: Choice): Promise<void> {
    if (this.isOpening) return;
    this.isOpening = true;
    try {
      const {listed, file} = choice;
      const report = listed.report ? await this.bytes(pageOf(listed, listed.report)) : null;
      const bytes = await this.bytes(pageOf(listed, file));
      await this.playback.open(file, choice.name, bytes, report && JSON.parse(new TextDecoder().decode(report)));
      if (this.playback.state !== 'ready') return;
      this.opened = choice;
      this.onOpened();
      this.goToLink();
    } catch (error) {
      toast((error as Error).message, true);
    } finally {
      this.isOpening = false;
    }
  }

  private async openBeside(index: string): Promise<void> {
    const choice = this.choices[Number(index)];
    if (index === '' || !choice) return this.beside.close();
    try {
      await this.beside.open(choice.file, await this.bytes(pageOf(choice.listed, choice.file)), choice.name);
    } catch (error) {
      byId<HTMLSelectElement>('debrief-beside').value = '';
      toast((error as Error).message, true);
    }
  }

  private async bytes(page: string): Promise<Uint8Array> {
    const answer = await this.endpoint.get(page);
    if (!answer?.ok) throw new Error(answer ? (await answer.text()).trim() : 'The daemon does not answer.');
    return new Uint8Array(await answer.arrayBuffer());
  }

  private async fetched(page: string, use: (answer: Response) => Promise<void>): Promise<void> {
    const answer = await this.endpoint.get(page);
    if (answer?.ok) await use(answer);
    else toast(answer ? (await answer.text()).trim() : 'The daemon does not answer.', true);
  }

  private async freeze(): Promise<void> {
    const kept = this.live.lastMinutes.recording();
    if (!kept) return;
    await this.playback.freeze('the running session', kept.entries, kept.base);
  }

  /** Another recording is shown, or none. */
  private onOpened(): void {
    if (this.playback.player === null || !this.isOpening) this.opened = null;
    if (this.playback.player === null) {
      this.beside.close();
      byId<HTMLSelectElement>('debrief-beside').value = '';
    }
    byId('debrief-opened').hidden = this.playback.player === null;
    setText(byId('debrief-name'), this.opened ? this.opened.name : this.playback.player?.name ?? '');
    const {findings} = this.playback;
    byId('debrief-findings').replaceChildren(...findings.map((finding) => {
      const item = element('li', '');
      const timeS = this.playback.timeOf(finding);
      if (timeS === null) {
        item.append(element('p', finding.text));
        return item;
      }
      const button = element('button', '');
      button.append(element('time', clock(timeS)), ' ', finding.text);
      button.addEventListener('click', () => {
        this.playback.jump(timeS);
        closeDrawers();
      });
      item.append(button);
      return item;
    }));
    setText(byId('debrief-none'), findings.length > 0 ? '' : this.opened && !this.opened.listed.report ? 'Not scored yet: that comes when the attempt ends.'
      : this.opened ? 'The score found nothing wrong.' : 'No report was opened with it: choose the session’s folder, or drop its report.json here.');
    this.showChoices();
  }

  /** To #t=12.3, of the recording that is open. */
  private goToLink(): void {
    const timeS = Number(new URLSearchParams(location.hash.slice(1)).get('t') ?? NaN);
    if (Number.isFinite(timeS)) this.playback.jump(timeS);
  }

  /** The page's address becomes that of this moment. */
  private async link(): Promise<void> {
    const {player} = this.playback;
    if (!player) return;
    const query = new URLSearchParams(location.search);
    if (this.opened) query.set('session', this.opened.listed.session);
    else query.delete('session');
    history.replaceState(null, '', `${location.pathname}?${query}#t=${player.positionS.toFixed(2)}`);
    const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false) ?? false;
    toast(`${copied ? 'The link is copied' : 'The page’s address is the link'}${this.opened ? '' : ': it needs the same file'}.`);
  }
}

const pageOf = ({session}: Listed, file: string): string => `sessions/${session.split('/').map(encodeURIComponent).join('/')}/${file}`;

/** The newest first. */
function choicesOf(sessions: readonly Listed[]): Choice[] {
  return sessions.flatMap((listed) => listed.recordings.map(({file}, part): Choice => ({
    listed, file, name: `${listed.trainee || 'not named'}, ${listed.task || listed.session}${part > 0 ? `, part ${part + 1}` : ''}`,
  }))).reverse();
}
