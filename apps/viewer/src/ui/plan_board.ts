// The template's holes as buttons, with letters and numbers, and behind them gland, organs and seeds at a chosen depth.
import type {Session} from '../model/session.js';
import {columnName, holeName, rowName, type TemplateGrid} from '../protocol/scene_message.js';
import {outline} from '../scene/outline.js';
import {TISSUE, structureColour} from '../scene/structures.js';
import {byId, setText} from './dom.js';

const SEED_REACH_MM = 2.5;  // of a seed's middle from the plane in which it is shown

export class PlanBoard {
  private grid = '';
  private drawn: unknown[] = [];
  private depthMm = NaN;

  constructor(private readonly session: Session, private readonly choose: (hole: string) => void, onCut: () => void) {
    byId<HTMLInputElement>('plan-section').addEventListener('input', (event) => {
      this.depthMm = Number((event.target as HTMLInputElement).value);
      onCut();
    });
  }

  /** Between which depths the gland lies, mm beyond the template; NaN: not known. */
  glandDepths(): [number, number] {
    const {low, high} = this.session.surfaceBox();
    const depth = (z: number): number => this.session.depthBeyondTemplate([0, 0, z]) ?? NaN;
    return [depth(low[2]!), depth(high[2]!)];
  }

  show(grid: TemplateGrid): void {
    const key = `${grid.columns} ${grid.rows} ${grid.fromRight} ${grid.halfSteps}`;
    if (this.grid !== key) this.makeGrid(grid);
    this.grid = key;
    this.showCut(grid);
  }

  // Seen from the feet: the first column is on the right, the first row below.
  private makeGrid(grid: TemplateGrid): void {
    const host = byId('plan-grid');
    host.style.gridTemplateColumns = `var(--label) repeat(${grid.columns}, 1fr)`;
    const label = (text: string): HTMLElement => Object.assign(document.createElement('span'), {textContent: text, ariaHidden: 'true'});
    const letters = Array.from({length: grid.columns}, (_, i) => label(columnName(grid.columns - 1 - i, grid)));
    host.replaceChildren();
    for (let row = grid.rows - 1; row >= 0; --row) {
      host.append(label(rowName(row, grid)));
      for (let column = grid.columns - 1; column >= 0; --column) {
        const button = document.createElement('button');
        button.dataset['hole'] = holeName({column, row}, grid);
        button.addEventListener('click', () => this.choose(button.dataset['hole']!));
        host.append(button);
      }
    }
    host.append(label(''), ...letters);
  }

  private showCut(grid: TemplateGrid): void {
    const [low, high] = this.glandDepths();
    const {topology, scene, plan} = this.session;
    if (!topology || !scene || !Number.isFinite(low)) return;
    if (!(this.depthMm >= low && this.depthMm <= high)) this.depthMm = Math.round(low + high) / 2;
    const now = [topology, scene, plan, this.depthMm];
    if (now.every((value, i) => value === this.drawn[i])) return;
    this.drawn = now;
    const slider = byId<HTMLInputElement>('plan-section');
    slider.min = String(Math.ceil(2 * low) / 2);
    slider.max = String(Math.floor(2 * high) / 2);
    slider.value = String(this.depthMm);
    setText(byId('plan-section-mm'), `${this.depthMm.toFixed(1)} mm`);

    const z = grid.origin[2] + this.depthMm;
    const across = (x: number): number => grid.columns - 0.5 - (x - grid.origin[0]) / grid.spacingMm;
    const down = (y: number): number => grid.rows - 0.5 - (y - grid.origin[1]) / grid.spacingMm;
    const parts = [
      {name: TISSUE, colour: structureColour(TISSUE, 0, scene.colours), mesh: {restPositions: topology.restPositions, triangles: topology.triangles}},
      ...scene.structures.map(({name, vertices, triangles}, i) => ({name, colour: structureColour(name, i, scene.colours), mesh: {restPositions: vertices, triangles}})),
    ];
    const svg = byId('plan-gland');
    svg.setAttribute('viewBox', `0 0 ${grid.columns} ${grid.rows}`);
    const shape = (tag: string, attributes: Record<string, string>): Element => {
      const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
      for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
      return made;
    };
    const lines = parts.map(({name, colour, mesh}) => {
      const cut = outline(mesh, 2, z);
      let d = '';
      for (let i = 0; i < cut.length; i += 4)
        d += `M${across(cut[i]!).toFixed(3)} ${down(cut[i + 1]!).toFixed(3)}L${across(cut[i + 2]!).toFixed(3)} ${down(cut[i + 3]!).toFixed(3)}`;
      return shape('path', {d, stroke: colour, 'data-structure': name});
    });
    const seeds = [...this.session.plannedSeeds().values()].filter(({position}) => Math.abs(position[2] - z) <= SEED_REACH_MM)
      .map(({position}) => shape('circle', {cx: across(position[0]).toFixed(3), cy: down(position[1]).toFixed(3), r: '0.16'}));
    svg.replaceChildren(...lines, ...seeds);
  }
}
