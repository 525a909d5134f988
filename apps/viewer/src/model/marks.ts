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

/** Throws Error where it is no report. */
export function findingsOf(report: unknown): Finding[] {
  const findings = (report as {findings?: unknown} | null)?.findings;
  if (!Array.isArray(findings)) throw new Error('it is no report of brachy score');
  return findings.map((finding: {text?: unknown; at_s?: unknown}) => ({
    text: String(finding.text ?? ''), atS: typeof finding.at_s === 'number' ? finding.at_s : null,
  }));
}
