// The panels Display and Clipping plane, and the colour bar.
import type {Settings} from '../model/settings.js';
import {cssGradient} from '../scene/colours.js';
import {byId, setText} from './dom.js';

const CHECKS = {
  wireframe: 'wireframe', points: 'points', structures: 'structures', template: 'template', plan: 'plan', clip: 'clip', field: 'field',
  'clip-flipped': 'clipFlipped', terms: 'terms',
} as const;

export class DisplayPanel {
  constructor(private readonly settings: Settings, private readonly onChange: () => void) {
    for (const [id, key] of Object.entries(CHECKS))
      byId<HTMLInputElement>(id).addEventListener('change', (event) => this.change({[key]: (event.target as HTMLInputElement).checked}));
    byId<HTMLInputElement>('opacity').addEventListener('input', (event) => this.change({opacity: Number((event.target as HTMLInputElement).value)}));
    byId<HTMLInputElement>('clip-share').addEventListener('input', (event) => this.change({clip: true, clipShare: Number((event.target as HTMLInputElement).value)}));
    for (const button of byId('colour').querySelectorAll('button'))
      button.addEventListener('click', () => this.change({colour: button.dataset['value'] as Settings['colour']}));
    for (const button of byId('clip-axis').querySelectorAll('button'))
      button.addEventListener('click', () => this.change({clip: true, clipAxis: Number(button.dataset['value']) as 0 | 1 | 2}));
    this.show();
  }

  change(some: Partial<Settings>): void {
    Object.assign(this.settings, some);
    this.settings.version += 1;
    this.show();
    this.onChange();
  }

  private show(): void {
    const s = this.settings;
    for (const [id, key] of Object.entries(CHECKS)) byId<HTMLInputElement>(id).checked = s[key];
    byId<HTMLInputElement>('opacity').value = String(s.opacity);
    byId<HTMLInputElement>('clip-share').value = String(s.clipShare);
    for (const [host, value] of [['colour', s.colour], ['clip-axis', s.clip ? String(s.clipAxis) : '']] as const)
      for (const button of byId(host).querySelectorAll('button')) button.setAttribute('aria-pressed', String(button.dataset['value'] === value));
  }

  /** Updates what depends on the mesh: position of the plane, and the colour bar. */
  update(box: {low: number[]; high: number[]}, scales: {mostMm: number; mostGy: number}, knowsDose: boolean): void {
    const s = this.settings;
    const place = box.low[s.clipAxis]! + s.clipShare * (box.high[s.clipAxis]! - box.low[s.clipAxis]!);
    setText(byId('clip-value'), `${place.toFixed(1)} mm`);

    const dose = s.colour === 'dose';
    const hasMesh = box.high[0]! > box.low[0]!;
    const shown = hasMesh && (dose || s.colour === 'displacement' || (s.clip && s.field));
    const bar = byId('colour-bar');
    bar.hidden = !shown;
    if (!shown) return;
    const most = dose ? scales.mostGy : scales.mostMm;
    const key = `${dose} ${most} ${knowsDose}`;
    if (bar.dataset['key'] === key) return;
    bar.dataset['key'] = key;
    setText(bar.querySelector('.title')!, dose ? (knowsDose ? 'Dose, Gy' : 'Dose, Gy (none on the surface yet)') : 'Displacement, mm');
    bar.querySelector('i')!.style.background = cssGradient(dose ? 'dose' : 'displacement');
    bar.querySelector('ol')!.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((share) => {
      const item = document.createElement('li');
      const value = share * most;
      item.style.bottom = `${100 * share}%`;
      item.textContent = dose ? `${Math.round(value)}${share === 0.5 ? ' (Rx)' : ''}` : String(+value.toPrecision(3));
      return item;
    }));
  }
}
