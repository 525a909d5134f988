// A key and what it does.

export interface Shortcut {
  /** As KeyboardEvent.key has it, in lower case. */
  key: string;
  /** Label in the help, where it differs from the key. */
  shown?: string;
  does: string;
  run: (event: KeyboardEvent) => void;
  released?: () => void;
}

/** Throws an Error where two shortcuts have the same key: only one of them would ever run. */
export function shortcutsByKey(shortcuts: readonly Shortcut[]): Map<string, Shortcut> {
  const byKey = new Map<string, Shortcut>();
  for (const shortcut of shortcuts) {
    const other = byKey.get(shortcut.key);
    if (other) throw new Error(`The key "${shortcut.key}" is bound twice: "${other.does}" and "${shortcut.does}".`);
    if (shortcut.key !== shortcut.key.toLowerCase()) throw new Error(`The key "${shortcut.key}" is not in lower case: nothing would find it.`);
    byKey.set(shortcut.key, shortcut);
  }
  return byKey;
}
