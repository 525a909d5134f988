// Pictures for the documents: of a simulation that keeps its pace, or none.
import {writeFileSync} from 'node:fs';

/** Why a picture of a page in this state shows a simulation that does not keep its pace; '': it does. `ticks`: brachy.ticks of the page. */
export function refusal({missedBefore, missed, perSecond, nominalPerSecond}) {
  if (missed > missedBefore) return `${missed - missedBefore} ticks were missed while the picture was made`;
  if (nominalPerSecond > 0 && perSecond < 0.97 * nominalPerSecond) return `${perSecond.toFixed(0)} of ${nominalPerSecond} ticks a second were simulated`;
  return '';
}

/** Stores a picture of the page. Throws where ticks were missed since the page was opened: the machine is busy, and the picture would show it. */
export async function storePicture(page, path) {
  const png = await page.screenshot();
  const why = refusal(await page.evaluate('brachy.ticks'));
  if (why) throw new Error(`${path} is not stored: ${why}; end what else runs on this machine, and take the pictures again`);
  writeFileSync(path, png);
}
