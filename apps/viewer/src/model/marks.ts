// What stands out on the time line of a recording: events of the tissue and the seeds, missed ticks, and a score's findings.
import {EventKind, type ServerEvent} from '../protocol/server_messages.js';

export const MARK_KINDS = ['finding', 'organ', 'lost', 'drop', 'puncture', 'missed'] as const;
export type MarkKind = (typeof MARK_KINDS)[number];

export interface Mark {
  /** Of the recording. */
  timeS: number;
  kind: MarkKind;
  text: string;
}

const OF_EVENT = new Map<number, MarkKind>([
  [EventKind.Puncture, 'puncture'], [EventKind.Structure, 'organ'], [EventKind.Seed, 'drop'], [EventKind.SeedLost, 'lost'],
]);

/** null: nothing that a time line shows. */
export function markOfEvent(event: ServerEvent, timeS: number): Mark | null {
  const kind = OF_EVENT.get(event.kind);
  return kind ? {timeS, kind, text: event.text} : null;
}

/** Missed ticks, of frames one after the other: those less than `APART_S` apart are one mark. */
export class MissedTicks {
  readonly marks: Mark[] = [];
  private before = NaN;
  private lastS = -Infinity;
  private count = 0;

  /** `overruns`: of all ticks until then. */
  add(overruns: number, timeS: number): void {
    const missed = overruns - this.before;
    this.before = overruns;
    if (!(missed > 0)) return;
    const joins = timeS - this.lastS < APART_S;
    this.count = joins ? this.count + missed : missed;
    this.lastS = timeS;
    const text = `${this.count} tick${this.count === 1 ? '' : 's'} missed`;
    if (joins) this.marks.at(-1)!.text = text;
    else this.marks.push({timeS, kind: 'missed', text});
  }
}
const APART_S = 1;

/** A finding of a score (report.json, hdr_report.json). */
export interface Finding {
  text: string;
  /** On the session's clock; null: of no moment, or of a report that does not say. */
  atS: number | null;
}

export interface Report {
  findings: Finding[];
  /** When each seed fell, by its number, on the session's clock. */
  seedsS: Map<number, number>;
}
interface ReportFile {
  findings?: {text?: unknown; at_s?: unknown}[];
  seeds?: {each?: {seed: number; t_s: number}[]} | null;
}

/** Throws Error where it is no report. */
export function reportOf(file: unknown): Report {
  const report = file as ReportFile | null;
  if (!Array.isArray(report?.findings)) throw new Error('it is no report of brachy score');
  const findings = report.findings.map(({text, at_s: atS}) => ({text: String(text ?? ''), atS: typeof atS === 'number' ? atS : null}));
  return {findings, seedsS: new Map((report.seeds?.each ?? []).map((seed) => [seed.seed, seed.t_s]))};
}

/** By how much a recording's clock is ahead of its session's, s, by the seeds that fell: both are the trainee's. Null: none fell in it. */
export function clockOffsetS({seedsS}: Report, marks: readonly Mark[]): number | null {
  const offsets = marks.flatMap(({kind, text, timeS}) => {
    const fellS = kind === 'drop' ? seedsS.get(Number(/^seed (\d+) dropped/.exec(text)?.[1] ?? NaN)) : undefined;
    return fellS === undefined ? [] : timeS - fellS;
  }).sort((a, b) => a - b);
  return offsets[offsets.length >> 1] ?? null;
}
