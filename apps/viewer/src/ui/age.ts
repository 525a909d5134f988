// What is older than half a second is shown as old: in grey, with its age.
import type {Session} from '../model/session.js';
import type {LiveConnection} from '../transport/live.js';
import type {Player} from '../transport/player.js';

const OLD_S = 0.5;

/** How old the picture of the tissue is, s; null: it is of now, or of a recording, or there is none. */
export function ageOfPicture(live: LiveConnection, player: Player | null, session: Session, nowMs: number): number | null {
  if (player || !session.frame || live.status.phase === 'off') return null;
  const ageS = session.ageMs(nowMs) / 1000;
  return ageS > OLD_S ? ageS : null;
}

export const ageText = (ageS: number): string => (ageS < 60 ? `${ageS.toFixed(1)} s old` : `${Math.floor(ageS / 60)} min old`);
