// What the daemon reports, in a trainee's words. The daemon's own text, with the researcher's terms, stays in the title, or is shown
// instead where the switch "technical terms" is on.

const CLOSE = 'The tissue is close to folding: go slower.';

/** Each part of an EVENT's text that has other words. */
const WORDS: readonly (readonly [RegExp, string])[] = [
  [/field folds at \([^)]*\) mm/, 'The tissue would fold here: go slower, or back.'],
  [/not known whether the field folds/, 'It is not known whether the tissue folds here.'],
  [/injective again/, 'The tissue follows the needle again.'],
  [/sub-steps: \d+/, CLOSE],
  [/landmarks clamped [\d.]+ mm( \([^)]*\))?/, 'The tissue cannot follow the needle here: go slower, or back.'],
  [/landmarks merged/, 'Two parts of needles are so near that they count as one.'],
  [/landmarks left out/, 'Parts of needles are too near each other: some are not felt.'],
  [/landmarks not solved: the last field stands/, 'The tissue is shown as it was a moment ago.'],
  [/stick and slip not settled/, 'The friction on the needle is uncertain.'],
  [/a needle bends by more than 8°/, 'The needle bends too far: draw it back and go in straight.'],
  [/capsule punctured/, 'The needle went through the capsule.'],
  [/^free$/, 'The needle is free.'],
  [/^touching$/, 'The needle touches the tissue.'],
  [/^inserted$/, 'The needle is in the tissue.'],
  [/^through$/, 'The tip came out on the far side.'],
  [/^withdrawn$/, 'The needle is out of the tissue.'],
  [/no pose for 50 ms: force removed; send poses at 20 Hz or more, then arm/, 'The instrument was not heard: it gives no force until it is switched on again.'],
  [/pose has NaN or infinity: force removed; repair the tracking, then arm/, 'The instrument cannot be followed: it gives no force until it is switched on again.'],
  [/device lost in contact: force removed; connect, then arm/, 'The instrument was lost in the tissue: it gives no force until it is there and switched on again.'],
  [/force limited to the device's maximum.*$/, 'The force is more than the instrument can give.'],
  [/change of force limited to 0\.5 N\/ms.*$/, 'The force changes too fast for the instrument: go slower.'],
  [/stiffness limited to what the loop renders stably.*$/, 'The tissue feels softer than it is: the instrument is too slow for more.'],
];
const SEED = /^(seed \d+ dropped), at rest at \([^)]*\) mm(?:, ([\d.]+) mm from where the plan has it)?$/;
const DEVICE = /^device (.*) (attached|left)( .*)?$/;

/** The text of an EVENT in a trainee's words; as it is where it has none. */
export function inPlainWords(text: string): string {
  const seed = SEED.exec(text);
  if (seed) return `${capital(seed[1]!)}${seed[2] ? `, ${seed[2]} mm from its place in the plan` : ''}.`;
  const found = WORDS.filter(([pattern]) => pattern.test(text)).map(([, words]) => words);
  if (found.length > 0) return [...new Set(found)].join(' ');
  const device = DEVICE.exec(text);
  if (device) return `${capital(device[1]!.replace(/ \([^)]*\)$/, ''))} ${device[2] === 'attached' ? 'takes' : 'lets go of'} the instrument.`;
  return capital(text);
}

const capital = (text: string): string => `${text.charAt(0).toUpperCase()}${text.slice(1)}`;
