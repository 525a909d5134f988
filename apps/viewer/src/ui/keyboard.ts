// Shortcuts, and the help that lists them.
import {byId} from './dom.js';
import {shortcutsByKey, type Shortcut} from './shortcuts.js';

const NOTES = [
  'Drag turns the view, the wheel zooms, the right button or two fingers shift it. With the needle in your hand, a drag that starts near the needle moves it; Shift or the wheel goes deeper.',
  'The patient’s right is on the left, as in radiology; axial looks from the feet, through the template. Lengths in mm, patient RAS.',
  'Volume study: on the image, arrows move the chosen point by 0.5 mm (with Shift 0.1), [ and ] choose, Enter adds, Delete removes, Ctrl+Z takes back. + and − go to the next slice, F freezes it.',
  'The surface alone is sent as a rule; inner points and the displacement on the clipping plane ask for the whole volume.',
  'The verdict beside the connection is the field’s certificate: injective (det J > 0 everywhere), folded, or not known. Late, in grey: how far the tissue shown lags behind that field.',
  'For research and training. Not a medical device.',
];

/** What is typed in these is their own. */
const FIELDS = 'textarea, select, [contenteditable], input:not([type="range"], [type="checkbox"], [type="radio"], [type="button"])';

export class Keyboard {
  private readonly byKey: Map<string, Shortcut>;

  constructor(shortcuts: Shortcut[]) {
    this.byKey = shortcutsByKey(shortcuts);
    addEventListener('keydown', (event) => this.down(event));
    addEventListener('keyup', (event) => this.byKey.get(event.key.toLowerCase())?.released?.());
    byId('help-button').addEventListener('click', () => this.help());
    const list = document.createElement('dl');
    for (const shortcut of shortcuts) {
      const key = document.createElement('dt');
      const does = document.createElement('dd');
      const cap = document.createElement('kbd');
      cap.textContent = shortcut.shown ?? shortcut.key.toUpperCase();
      key.append(cap);
      does.textContent = shortcut.does;
      if (shortcut.does) list.append(key, does);
    }
    byId('help-body').append(list, ...NOTES.map((note) => Object.assign(document.createElement('p'), {textContent: note})));
  }

  help(): void {
    byId<HTMLDialogElement>('help').showModal();
  }

  private down(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return;
    const target = event.target as HTMLElement;
    if (target.matches(FIELDS)) return;
    const own = target.matches('input[type="range"], [role="tab"]') && /^(Arrow|Page|Home|End)/.test(event.key);
    const presses = target.matches('button, summary, input[type="checkbox"]') && (event.key === ' ' || event.key === 'Enter');
    if (own || presses) return;
    const shortcut = this.byKey.get(event.key.toLowerCase());
    if (!shortcut || (event.repeat && !/^(arrow|page|\[|\])/.test(shortcut.key))) return;
    event.preventDefault();
    shortcut.run(event);
  }
}
