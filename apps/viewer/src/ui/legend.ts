// The legend: what structures there are, in their colours; each can be switched off.
import type {Settings} from '../model/settings.js';
import type {SceneMessage} from '../protocol/scene_message.js';
import {structureColour, TISSUE} from '../scene/structures.js';
import {byId} from './dom.js';

export class Legend {
  private shown: SceneMessage | null = null;

  /** `change` sets settings. */
  constructor(private readonly settings: Settings, private readonly change: (some: Partial<Settings>) => void) {
    byId<HTMLDetailsElement>('legend').open = !matchMedia('(max-width: 640px)').matches;
  }

  update(scene: SceneMessage | null): void {
    if (scene === this.shown) return;
    // A gland with a colour of its own shows it, at first.
    if (!this.shown && scene?.colours.has(TISSUE)) this.change({colour: 'none'});
    this.shown = scene;
    const entries = scene ? [
      {name: TISSUE, colour: structureColour(TISSUE, 0, scene.colours)},
      ...scene.structures.map(({name}, i) => ({name, colour: structureColour(name, i, scene.colours)})),
    ].filter(({name}, i, all) => all.findIndex((other) => other.name === name) === i) : [];
    byId('legend').hidden = entries.length === 0;
    byId('legend-entries').replaceChildren(...entries.map(({name, colour}) => this.entry(name, colour)));
  }

  private entry(name: string, colour: string): HTMLElement {
    const label = document.createElement('label');
    const box = document.createElement('input');
    box.type = 'checkbox';
    box.checked = !this.settings.hidden.has(name);
    box.dataset['structure'] = name;
    box.addEventListener('change', () => {
      const hidden = new Set(this.settings.hidden);
      if (box.checked) hidden.delete(name);
      else hidden.add(name);
      this.change({hidden});
    });
    const swatch = document.createElement('i');
    swatch.style.background = colour;
    label.append(box, swatch, name);
    return label;
  }
}
