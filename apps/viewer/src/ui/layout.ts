// Tabs of the charts, and the panels that are drawers on a tablet.
import {byId} from './dom.js';

const TABS = ['needle', 'dose', 'plan', 'ultrasound', 'exercise', 'debrief'] as const;
export type Tab = (typeof TABS)[number];

export function setUpTabs(onChange: (id: Tab) => void): (id: Tab) => void {
  const select = (id: Tab): void => {
    for (const tab of TABS) {
      byId(`tab-${tab}`).setAttribute('aria-selected', String(tab === id));
      byId(`tab-${tab}`).tabIndex = tab === id ? 0 : -1;
      byId(`panel-${tab}`).hidden = tab !== id;
    }
    document.body.classList.toggle('scanning', id === 'ultrasound');
    onChange(id);
  };
  for (const tab of TABS) {
    byId(`tab-${tab}`).addEventListener('click', () => select(tab));
    byId(`tab-${tab}`).addEventListener('keydown', (event) => {
      if (event.key !== 'ArrowLeft' && event.key !== 'ArrowRight') return;
      const shown = TABS.filter((candidate) => !byId(`tab-${candidate}`).hidden);
      const other = shown[(shown.indexOf(tab) + (event.key === 'ArrowRight' ? 1 : shown.length - 1)) % shown.length]!;
      select(other);
      byId(`tab-${other}`).focus();
    });
  }
  return select;
}

const SIDES = ['left', 'right'] as const;

function setDrawer(side: (typeof SIDES)[number], open: boolean): void {
  byId(side).classList.toggle('open', open);
  byId(`toggle-${side}`).setAttribute('aria-expanded', String(open));
}

/** So that the scene can be seen on a small screen. */
export function closeDrawers(): void {
  for (const side of SIDES) setDrawer(side, false);
}

export function setUpDrawers(): void {
  for (const side of SIDES) byId(`toggle-${side}`).addEventListener('click', () => setDrawer(side, !byId(side).classList.contains('open')));
  byId('scene').addEventListener('pointerdown', closeDrawers);
}
