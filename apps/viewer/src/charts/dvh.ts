// Dose-volume histograms, and the quality figures of an implant.
import uPlot from 'uplot';
import type {DoseGoal} from '../protocol/scene_message.js';
import type {Dose, StructureDose} from '../protocol/server_messages.js';
import {structureColour} from '../scene/structures.js';
import {COLOUR, axis, makeChart} from './chart.js';

/** What a dose is of, in words. */
export function doseNote(dose: Dose): string {
  const prescription = `prescription ${dose.prescriptionGy} Gy`;
  if (dose.fraction) {
    const {catheters, plannedCatheters, dwells, seconds} = dose.fraction;
    return `${catheters} of ${plannedCatheters} catheters, ${dwells} dwells in ${seconds.toFixed(1)} s of ${dose.airKermaStrengthU.toFixed(0)} U, ${prescription}; if the fraction were given now, where the catheters lie.${dose.withPlanned ? ' With plan: the other catheters lie where the plan has them.' : ''}`;
  }
  return `${dose.seeds} seeds, ${dose.airKermaStrengthU.toFixed(1)} U, ${prescription}; at their positions once all needles are out.${dose.withPlanned ? ' With plan: the planned seeds that are still to come lie where the plan has them.' : ''}`;
}

interface Figure {
  structure: string;
  name: string;
}

/** What DOSE says of a structure, by the names of `brachy score`'s figures. */
const VALUES: Record<string, {unit: string; of: (dose: StructureDose) => number}> = {
  V100: {unit: '%', of: (d) => d.v100Percent},
  V150: {unit: '%', of: (d) => d.v150Percent},
  V200: {unit: '%', of: (d) => d.v200Percent},
  V100cc: {unit: 'cm³', of: (d) => d.v100Cc},
  D90: {unit: 'Gy', of: (d) => d.d90Gy},
  D30: {unit: 'Gy', of: (d) => d.d30Gy},
  D10: {unit: 'Gy', of: (d) => d.d10Gy},
  D2cc: {unit: 'Gy', of: (d) => d.d2ccGy},
};

/** Shown whether or not the scene has a goal for them; goals for others follow. */
const FIGURES: Figure[] = [
  {structure: 'prostate', name: 'V100'}, {structure: 'prostate', name: 'V150'}, {structure: 'prostate', name: 'V200'},
  {structure: 'prostate', name: 'D90'}, {structure: 'urethra', name: 'D30'}, {structure: 'urethra', name: 'D10'},
  {structure: 'rectum', name: 'V100cc'}, {structure: 'rectum', name: 'D2cc'},
];

export class DvhPanel {
  private chart: uPlot | null = null;
  private names = '';

  constructor(private readonly host: HTMLElement, private readonly legend: HTMLElement, private readonly table: HTMLTableElement) {}

  /** `goals`: those of the implant are shown. */
  show(dose: Dose | null, goals: readonly DoseGoal[], colours?: ReadonlyMap<string, string>): void {
    const colourOf = (name: string, index: number): string => structureColour(name, index, colours);
    this.host.classList.toggle('empty', dose === null);
    this.table.hidden = dose === null;
    this.table.tHead!.replaceChildren(...(dose ? [headings(dose)] : []));
    this.table.tBodies[0]!.replaceChildren(...(dose ? rows(dose, goals.filter((goal) => !goal.ofPlan)) : []));
    if (!dose) {
      this.chart?.destroy();
      this.chart = null;
      this.names = '';
      this.legend.replaceChildren();
      return;
    }
    const curves = [
      ...dose.structures.map((structure, i) => ({structure, colour: colourOf(structure.name, i), dash: [] as number[]})),
      ...(dose.withPlanned ?? []).map((structure, i) => ({structure, colour: colourOf(structure.name, i), dash: [5, 4]})),
    ];
    const names = curves.map(({structure, colour, dash}) => `${structure.name} ${colour} ${dash.length}`).join('\n');
    const length = Math.max(...curves.map(({structure}) => structure.volumeShare.length), 1);
    const data = [
      Array.from({length}, (_, percent) => (percent * dose.prescriptionGy) / 100),
      ...curves.map(({structure}) => Array.from({length}, (_, i) => 100 * (structure.volumeShare[i] ?? 0))),
    ] as uPlot.AlignedData;
    if (this.chart && names === this.names) return this.chart.setData(data);
    this.names = names;
    this.chart?.destroy();
    this.chart = makeChart(this.host, {
      scales: {x: {time: false, range: [0, 2.5 * dose.prescriptionGy]}, y: {range: [0, 102]}},
      axes: [axis('dose, Gy', 'x'), axis('volume, %', 'y')],
      series: [{}, ...curves.map(({colour, dash}): uPlot.Series => ({stroke: colour, width: dash.length ? 1.25 : 2, dash, points: {show: false}}))],
      hooks: {draw: [(chart) => drawPrescription(chart, dose.prescriptionGy), (chart) => drawNames(chart, curves.slice(0, dose.structures.length).map(({structure, colour}) => ({name: structure.name, colour})))]},
    }, data);
    this.legend.replaceChildren(
      ...dose.structures.map((structure, i) => legendItem(structure.name, colourOf(structure.name, i))),
      ...(dose.withPlanned ? [legendItem('with plan', 'dashed')] : []));
  }
}

/** Each structure's name beside its own curve, so that no colour is needed to tell them. */
function drawNames(chart: uPlot, curves: readonly {name: string; colour: string}[]): void {
  const context = chart.ctx;
  context.save();
  context.font = `600 ${10 * devicePixelRatio}px system-ui, sans-serif`;
  context.textAlign = 'left';
  curves.forEach(({name, colour}, i) => {
    const shares = chart.data[i + 1] as number[];
    const doses = chart.data[0] as number[];
    const level = 88 - 17 * (i % 5);  // % of the volume
    const at = shares.findIndex((share) => share < level);
    if (at < 1) return;
    context.fillStyle = colour;
    context.fillText(name, chart.valToPos(doses[at]!, 'x', true) + 5 * devicePixelRatio, chart.valToPos(level, 'y', true));
  });
  context.restore();
}

function legendItem(text: string, line: string): HTMLElement {
  const item = document.createElement('span');
  if (line === 'dashed') item.className = 'dashed';
  else item.style.setProperty('--line', line);
  item.textContent = text;
  return item;
}

function drawPrescription(chart: uPlot, gy: number): void {
  const x = chart.valToPos(gy, 'x', true);
  const context = chart.ctx;
  context.save();
  context.strokeStyle = 'rgba(230, 238, 248, 0.5)';
  context.setLineDash([4 * devicePixelRatio, 4 * devicePixelRatio]);
  context.beginPath();
  context.moveTo(x, chart.bbox.top);
  context.lineTo(x, chart.bbox.top + chart.bbox.height);
  context.stroke();
  context.fillStyle = COLOUR.text;
  context.font = `${10 * devicePixelRatio}px system-ui, sans-serif`;
  context.textAlign = 'left';
  context.fillText(`${gy} Gy`, x + 5 * devicePixelRatio, chart.bbox.top + 12 * devicePixelRatio);
  context.restore();
}

function row(kind: 'th' | 'td', cells: readonly [text: string, className: string][]): HTMLElement {
  const made = document.createElement('tr');
  for (const [text, className] of cells) {
    const cell = document.createElement(kind);
    cell.textContent = text;
    cell.className = className;
    made.append(cell);
  }
  return made;
}

const headings = (dose: Dose): HTMLElement =>
  row('th', [['', ''], ['so far', 'number'], ...(dose.withPlanned ? [['with plan', 'number'] as [string, string]] : []), ['goal', 'number']]);

function rows(dose: Dose, goals: readonly DoseGoal[]): HTMLElement[] {
  const others = goals.filter((goal) => VALUES[goal.figure] && !FIGURES.some((f) => f.structure === goal.structure && f.name === goal.figure));
  const figures = [...FIGURES, ...others.map((goal) => ({structure: goal.structure, name: goal.figure}))];
  return figures.flatMap(({structure, name}) => {
    const {unit, of} = VALUES[name]!;
    const goal = goals.find((candidate) => candidate.structure === structure && candidate.figure === name);
    const digits = unit === 'cm³' ? 2 : 1;
    const valueIn = (structures: readonly StructureDose[]): number | null => {
      const found = structures.find((candidate) => candidate.name === structure);
      return found ? of(found) : null;
    };
    const cell = (value: number): [string, string] => {
      if (Number.isNaN(value)) return ['—', 'number'];
      if (!goal) return [value.toFixed(digits), 'number'];
      const met = goal.above ? value >= goal.limit : value < goal.limit;
      return [`${value.toFixed(digits)} ${met ? '✓' : '✗'}`, `number ${met ? 'met' : 'missed'}`];
    };
    const soFar = valueIn(dose.structures);
    if (soFar === null) return [];
    return [row('td', [
      [`${structure} ${name === 'V100cc' ? 'V100' : name}, ${unit}`, ''], cell(soFar),
      ...(dose.withPlanned ? [cell(valueIn(dose.withPlanned) ?? NaN)] : []),
      [goal ? `${goal.above ? '≥' : '<'} ${+goal.limit.toFixed(1)}` : '', 'number goal'],
    ])];
  });
}
