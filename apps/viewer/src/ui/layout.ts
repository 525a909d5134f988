// Tabs of the charts, and the panels that are drawers on a tablet.
import {byId} from './dom.js';

export function setUpTabs(onChange: () => void): (id: 'needle' | 'dose') => void {
  const tabs = ['needle', 'dose'] as const;
  const select = (id: 'needle' | 'dose'): void => {
    for (const tab of tabs) {
      byId(`tab-${tab}`).setAttribute('aria-selected', String(tab === id));
      byId(`tab-${tab}`).tabIndex = tab === id ? 0 : -1;
      byId(`panel-${tab}`).hidden = tab !== id;
    }
    onChange();
  };
  tabs.forEach((tab, i) => {
    byId(`tab-${tab}`).addEventListener('click', () => select(tab));
    byId(`tab-${tab}`).addEventListener('keydown', (event) => {
      if (event.key !== 'ArrowLeft' && event.key !== 'ArrowRight') return;
      const other = tabs[1 - i]!;
      select(other);
      byId(`tab-${other}`).focus();
    });
  });
  return select;
}

export function setUpDrawers(): void {
  for (const side of ['left', 'right']) {
    const button = byId(`toggle-${side}`);
    const set = (open: boolean): void => {
      byId(side).classList.toggle('open', open);
      button.setAttribute('aria-expanded', String(open));
    };
    button.addEventListener('click', () => set(!byId(side).classList.contains('open')));
    byId('scene').addEventListener('pointerdown', () => set(false));
  }
}
