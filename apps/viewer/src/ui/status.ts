// Status display: pills, banner, counters, read-outs and events.
import type {Session} from '../model/session.js';
import {ContactState, StepFlag, type Certificate, type Frame} from '../protocol/frame.js';
import {EventKind} from '../protocol/server_messages.js';
import type {LiveConnection} from '../transport/live.js';
import type {Player} from '../transport/player.js';
import {ageText} from './age.js';
import {byId, figure, setText} from './dom.js';
import {inPlainWords} from './words.js';

function pill(id: string, text: string, className: string): void {
  const element = byId(id);
  if (element.className !== `pill ${className}`) element.className = `pill ${className}`;
  setText(element.querySelector('b')!, text);
}

/** `ageS`: of a picture that is old, else null; as below. */
export function showConnection(live: LiveConnection, player: Player | null, session: Session, ageS: number | null): void {
  const banner = byId('banner');
  const status = live.status;
  setText(byId('source'), player ? player.name : session.topology?.name ?? '');
  const problem = 'problem' in status ? status.problem : '';
  banner.hidden = player !== null || problem === '';
  if (player) return pill('connection', 'recording', 'warm');
  switch (status.phase) {
    case 'open': return ageS !== null ? pill('connection', `no picture · ${ageText(ageS)}`, 'warm') : pill('connection', session.welcome ? `live · ${session.welcome.server}` : 'live', 'good');
    case 'refused':
      setText(banner.querySelector('p')!, problem);
      return pill('connection', 'refused', 'bad');
    case 'off': return pill('connection', 'no daemon', '');
    case 'connecting':
      if (problem) setText(banner.querySelector('p')!, `${problem} Reconnecting…`);
      return pill('connection', 'connecting…', 'warm');
    case 'waiting': {
      const seconds = Math.max(0, Math.ceil((status.untilMs - performance.now()) / 1000));
      setText(banner.querySelector('p')!, `${problem} Reconnecting in ${seconds} s.`);
      return pill('connection', 'not connected', 'bad');
    }
  }
}

/** Of a frame in which some of the tissue is where an earlier tick put it; '' of others. By how much, where that is known and can be seen. */
export function lateText({stepFlags, lagMm}: Pick<Frame, 'stepFlags' | 'lagMm'>): string {
  if ((stepFlags & StepFlag.Late) === 0) return '';
  return lagMm !== null && lagMm >= 0.005 ? ` · ${lagMm.toFixed(2)} mm late` : ' · late';
}

/** The verdict in the researcher's terms and in a trainee's words. */
export function verdictOf(certificate: Certificate | null | undefined): {terms: string; words: string; state: 'good' | 'warm' | 'bad'} {
  if (!certificate || certificate.verdict === 'unknown') return {terms: 'folding unknown', words: 'folding unknown', state: 'warm'};
  if (certificate.verdict === 'folded') return {terms: 'FIELD FOLDS', words: 'TISSUE FOLDS: go back', state: 'bad'};
  const clamped = certificate.heldMm > 0 ? ` · clamped by ${certificate.heldMm.toFixed(1)} mm` : '';
  const steps = certificate.substeps > 1 ? ` · ${certificate.substeps} sub-steps` : '';
  return {terms: `injective${steps}${clamped}`, words: clamped ? 'too fast for the tissue: go slower' : steps ? 'close to folding: go slower' : 'tissue follows', state: clamped ? 'warm' : 'good'};
}

/** `terms`: in the researcher's. */
export function showVerdict(session: Session, terms: boolean, ageS: number | null): void {
  const element = byId('verdict');
  element.hidden = session.frame === null;
  if (!session.frame) return;
  setText(byId('late'), ageS !== null ? ` · ${ageText(ageS)}` : lateText(session.frame));
  const verdict = verdictOf(session.frame.certificate);
  element.title = `Certificate of the displacement field: ${verdict.terms}. Injective: det J > 0 everywhere, nothing folds. Late: how far the tissue shown lags behind that field, at most`;
  pill('verdict', terms ? verdict.terms : verdict.words, ageS !== null ? 'old' : verdict.state);
}

/** In grey what is old: the picture, read-outs, and the needle with them. */
export function showAge(ageS: number | null): void {
  document.body.classList.toggle('old', ageS !== null);
  const note = byId('age-note');
  note.hidden = ageS === null;
  if (ageS !== null) setText(note, `This picture is ${ageText(ageS)}.`);
}

export function showReadouts(session: Session, needle: number): void {
  const record = session.frame?.needles.find((candidate) => candidate.id === needle);
  const present = record?.present === true;
  const unit = (value: string, name: string): string => (value === '—' ? value : `${value} <small>${name}</small>`);
  const set = (id: string, html: string): void => {
    const element = byId(id);
    if (element.innerHTML !== html) element.innerHTML = html;
  };
  const tip = present ? [record.pose[3]!, record.pose[7]!, record.pose[11]!] : null;
  const depth = tip && session.depthBeyondTemplate(tip);
  set('r-depth', unit(figure(depth ?? undefined), 'mm'));
  setText(byId('hand-depth'), depth === null ? '' : `${figure(depth)} mm deep`);
  set('r-axial', unit(figure(present ? record.forces?.axialN : undefined, 2), 'N'));
  const shape = present ? record.shape : null;
  const steep = shape !== null && ((session.frame?.stepFlags ?? 0) & StepFlag.Steep) !== 0;
  byId('r-bend-cell').hidden = shape === null;
  byId('r-bend-cell').classList.toggle('warn', steep);
  if (shape) set('r-bend', unit(figure(Math.hypot(...shape.tipDeflection)), steep ? 'mm, over 8°' : 'mm'));
  set('r-contact', present ? ContactState[record.contact] ?? 'other' : '—');
}

export function showCounters(live: LiveConnection, player: Player | null, session: Session): void {
  const nowMs = performance.now();
  const state = session.state;
  const bytes = session.byteRate.perSecond(nowMs);
  const rows: [string, string, string, boolean?][] = [
    ['snapshots', `${figure(session.snapshotRate.perSecond(nowMs))}/s`, 'Snapshots received in the last two seconds'],
    ['ticks', `${figure(session.tickRate.perSecond(nowMs), 0)}/s`, 'Ticks simulated in the last two seconds'],
    ['latency', `${figure(state?.latencyMs.count ? state.latencyMs.p50 : undefined)} / ${figure(state?.latencyMs.count ? state.latencyMs.p99 : undefined)} ms`,
     'From a pose to the mesh computed with it, in the daemon: p50 / p99 since its start'],
    ['missed', String(session.frame?.overruns ?? 0), "Tick deadlines missed since the daemon started", (session.frame?.overruns ?? 0) > 0],
    ['dropped', String(state?.snapshotsDropped ?? 0), 'Snapshots replaced by newer ones for this viewer'],
  ];
  if (!player) {
    rows.push(['mesh age', `${figure(session.meshAge.quantile(0.5))} / ${figure(session.meshAge.quantile(0.99))} ms`, "From the publication of the mesh to its arrival here: p50 / p99"],
      ['received', bytes > 1e6 ? `${(bytes / 1e6).toFixed(2)} MB/s` : `${(bytes / 1e3).toFixed(0)} kB/s`, 'Bytes received in the last two seconds'],
      ['needle held by', state?.deviceHolder || 'nobody', `Holder of the needle's lease: ${state?.deviceHolder || 'none'}`]);
    if (live.sequenceGaps > 0) rows.push(['gaps', String(live.sequenceGaps), 'Messages missing in the sequence', true]);
  }
  const host = byId('counters');
  while (host.children.length < rows.length) {
    const row = document.createElement('div');
    row.append(document.createElement('dt'), document.createElement('dd'));
    host.append(row);
  }
  while (host.children.length > rows.length) host.lastElementChild!.remove();
  rows.forEach(([name, value, title, bad], i) => {
    const row = host.children[i] as HTMLElement;
    row.title = title;
    row.classList.toggle('counters-more', !['snapshots', 'missed', 'needle held by'].includes(name));
    setText(row.firstElementChild!, name);
    setText(row.lastElementChild!, value);
    row.lastElementChild!.className = bad ? 'bad' : '';
  });
}

let eventsShown = '';

/** `terms`: as the daemon says it; else in a trainee's words, with the daemon's in the title. */
export function showEvents(session: Session, terms: boolean): void {
  const now = `${session.versions.events} ${terms}`;
  if (eventsShown === now) return;
  eventsShown = now;
  const host = byId('events');
  host.replaceChildren(...session.events.slice(-40).reverse().map((event) => {
    const item = document.createElement('li');
    const time = document.createElement('time');
    const text = document.createElement('span');
    time.textContent = `${event.timeS.toFixed(1)} s`;
    const words = inPlainWords(event.text);
    text.textContent = terms ? event.text : words;
    item.title = terms ? words : event.text;
    item.append(time, text);
    if (event.kind === EventKind.Warning || event.kind === EventKind.Safety) item.className = 'warning';
    if (event.kind === EventKind.Puncture) item.className = 'puncture';
    if (event.kind === EventKind.Seed) item.className = 'seed';
    if (event.kind === EventKind.Structure || event.kind === EventKind.SeedLost) item.className = 'harm';
    return item;
  }));
}
