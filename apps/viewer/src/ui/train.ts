// A needle's train as it is edited: s a seed, - a spacer, from the tip backwards.

export function hasSeedAt(train: string, at: number): boolean {
  return train[at] === 's';
}

/** The seed at `at` a spacer further back (+1) or towards the tip (−1), and where it is then; as it was where another seed or the tip is in the way. */
export function moveSeed(train: string, at: number, step: number): {train: string; at: number} {
  const same = {train, at};
  if (!hasSeedAt(train, at) || step === 0) return same;
  const to = at + step;
  if (to === train.length) return {train: `${train.slice(0, at)}-s`, at: to};
  if (train[to] !== '-') return same;
  const low = Math.min(at, to);
  const swapped = step > 0 ? '-s' : 's-';
  return {train: trimmed(`${train.slice(0, low)}${swapped}${train.slice(low + 2)}`), at: to};
}

/** Without the seed at `at`, the others where they are; the last one stays. */
export function removeSeed(train: string, at: number): string {
  if (!hasSeedAt(train, at) || train.replaceAll('-', '').length < 2) return train;
  return trimmed(`${train.slice(0, at)}-${train.slice(at + 1)}`);
}

/** Spacers behind the last seed hold nothing. */
function trimmed(train: string): string {
  return train.replace(/-+$/, '');
}
