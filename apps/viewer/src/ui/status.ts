// Status display: pills, banner, counters, read-outs and events.
import type {Session} from '../model/session.js';
import {ContactState, StepFlag, type Frame} from '../protocol/frame.js';
import {EventKind} from '../protocol/server_messages.js';
import type {LiveConnection} from '../transport/live.js';
import type {Player} from '../transport/player.js';
import {byId, figure, setText} from './dom.js';

function pill(id: string, text: string, className: string): void {
  const element = byId(id);
  if (element.className !== `pill ${className}`) element.className = `pill ${className}`;
  setText(element.querySelector('b')!, text);
}

export function showConnection(live: LiveConnection, player: Player | null, session: Session): void {
  const banner = byId('banner');
  const status = live.status;
  setText(byId('source'), player ? player.name : session.topology?.name ?? '');
  const problem = 'problem' in status ? status.problem : '';
  banner.hidden = player !== null || problem === '';
  if (player) return pill('connection', 'recording', 'warm');
  switch (status.phase) {
    case 'open': return pill('connection', session.welcome ? `live · ${session.welcome.server}` : 'live', 'good');
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

export function showVerdict(session: Session): void {
  const element = byId('verdict');
  element.hidden = session.frame === null;
  const certificate = session.frame?.certificate;
  if (!session.frame) return;
  setText(byId('late'), lateText(session.frame));
  if (!certificate || certificate.verdict === 'unknown') return pill('verdict', 'folding unknown', 'warm');
  if (certificate.verdict === 'folded') return pill('verdict', 'FIELD FOLDS', 'bad');
  const clamped = certificate.heldMm > 0 ? ` · clamped by ${certificate.heldMm.toFixed(1)} mm` : '';
  const steps = certificate.substeps > 1 ? ` · ${certificate.substeps} sub-steps` : '';
  pill('verdict', `injective${steps}${clamped}`, clamped ? 'warm' : 'good');
}

export function showReadouts(session: Session, needle: number): void {
  const record = session.frame?.needles.find((candidate) => candidate.id === needle);
  const present = record?.present === true;
  const unit = (value: string, name: string): string => (value === '—' ? value : `${value} <small>${name}</small>`);
  const set = (id: string, html: string): void => {
    const element = byId(id);
    if (element.innerHTML !== html) element.innerHTML = html;
  };
  set('r-depth', unit(figure(present ? record.forces?.tipDepthMm : undefined), 'mm'));
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
      ['device', state?.deviceHolder || 'none', `Holder of the needle's lease: ${state?.deviceHolder || 'none'}`]);
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
    setText(row.firstElementChild!, name);
    setText(row.lastElementChild!, value);
    row.lastElementChild!.className = bad ? 'bad' : '';
  });
}

let eventsShown = -1;

export function showEvents(session: Session): void {
  if (eventsShown === session.versions.events) return;
  eventsShown = session.versions.events;
  const host = byId('events');
  host.replaceChildren(...session.events.slice(-40).reverse().map((event) => {
    const item = document.createElement('li');
    const time = document.createElement('time');
    const text = document.createElement('span');
    time.textContent = `${event.timeS.toFixed(1)} s`;
    text.textContent = event.text;
    item.append(time, text);
    if (event.kind === EventKind.Warning || event.kind === EventKind.Safety) item.className = 'warning';
    if (event.kind === EventKind.Puncture) item.className = 'puncture';
    if (event.kind === EventKind.Seed) item.className = 'seed';
    if (event.kind === EventKind.Structure || event.kind === EventKind.SeedLost) item.className = 'harm';
    return item;
  }));
}
