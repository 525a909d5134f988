// Dose-volume histograms, and the quality figures of an implant.
import uPlot from 'uplot';
import type {Dose, StructureDose} from '../protocol/server_messages.js';
import {structureColour} from '../scene/structures.js';
import {COLOUR, axis, makeChart} from './chart.js';

/** As in `brachy score` (apps/score/dose_score.cpp): ABS goals, those in Gy in proportion to the prescription. */
const FIGURES: {structure: string; name: string; unit: string; of: (dose: StructureDose) => number; goal?: {above: boolean; limit: (gy: number) => number}}[] = [
  {structure: 'prostate', name: 'V100', unit: '%', of: (d) => d.v100Percent, goal: {above: true, limit: () => 95}},
  {structure: 'prostate', name: 'V150', unit: '%', of: (d) => d.v150Percent, goal: {above: false, limit: () => 60}},
  {structure: 'prostate', name: 'V200', unit: '%', of: (d) => d.v200Percent},
  {structure: 'prostate', name: 'D90', unit: 'Gy', of: (d) => d.d90Gy, goal: {above: true, limit: (gy) => (gy * 140) / 145}},
  {structure: 'urethra', name: 'D30', unit: 'Gy', of: (d) => d.d30Gy, goal: {above: false, limit: (gy) => gy * 1.25}},
  {structure: 'urethra', name: 'D10', unit: 'Gy', of: (d) => d.d10Gy},
  {structure: 'rectum', name: 'V100', unit: 'cm³', of: (d) => d.v100Cc, goal: {above: false, limit: () => 1}},
  {structure: 'rectum', name: 'D2cc', unit: 'Gy', of: (d) => d.d2ccGy},
];

const colourOf = (name: string, index: number): string => (name === 'prostate' ? '#ff8f7d' : structureColour(name, index));

export class DvhPanel {
  private chart: uPlot | null = null;
  private names = '';

  constructor(private readonly host: HTMLElement, private readonly legend: HTMLElement, private readonly table: HTMLElement) {}

  show(dose: Dose | null): void {
    this.host.classList.toggle('empty', dose === null);
    this.table.parentElement!.hidden = dose === null;
    this.table.replaceChildren(...(dose ? rows(dose) : []));
    if (!dose) {
      this.chart?.destroy();
      this.chart = null;
      this.names = '';
      this.legend.replaceChildren();
      return;
    }
    const names = dose.structures.map((structure) => structure.name).join('\n');
    const length = Math.max(...dose.structures.map((structure) => structure.volumeShare.length), 1);
    const data = [
      Array.from({length}, (_, percent) => (percent * dose.prescriptionGy) / 100),
      ...dose.structures.map((structure) => Array.from({length}, (_, i) => 100 * (structure.volumeShare[i] ?? 0))),
    ] as uPlot.AlignedData;
    if (this.chart && names === this.names) return this.chart.setData(data);
    this.names = names;
    this.chart?.destroy();
    this.chart = makeChart(this.host, {
      scales: {x: {time: false, range: [0, 2.5 * dose.prescriptionGy]}, y: {range: [0, 102]}},
      axes: [axis('dose, Gy', 'x'), axis('volume, %', 'y')],
      series: [{}, ...dose.structures.map((structure, i): uPlot.Series => ({stroke: colourOf(structure.name, i), width: 2, points: {show: false}}))],
      hooks: {draw: [(chart) => drawPrescription(chart, dose.prescriptionGy)]},
    }, data);
    this.legend.replaceChildren(...dose.structures.map((structure, i) => {
      const item = document.createElement('span');
      item.style.setProperty('--line', colourOf(structure.name, i));
      item.textContent = structure.name;
      return item;
    }));
  }
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

function rows(dose: Dose): HTMLElement[] {
  return FIGURES.flatMap((figure) => {
    const structure = dose.structures.find((candidate) => candidate.name === figure.structure);
    if (!structure) return [];
    const value = figure.of(structure);
    const limit = figure.goal?.limit(dose.prescriptionGy);
    const met = limit === undefined ? null : figure.goal!.above ? value > limit : value < limit;
    const row = document.createElement('tr');
    const cell = (text: string, className = ''): void => {
      const td = document.createElement('td');
      td.textContent = text;
      td.className = className;
      row.append(td);
    };
    cell(`${figure.structure} ${figure.name}`);
    cell(Number.isNaN(value) ? '—' : `${value.toFixed(figure.unit === 'cm³' ? 2 : 1)} ${figure.unit}`, 'number');
    cell(limit === undefined ? '' : `${figure.goal!.above ? '>' : '<'} ${+limit.toFixed(1)}`, 'number goal');
    cell(met === null || Number.isNaN(value) ? '' : met ? '✓ met' : 'not met', met ? 'met' : 'missed');
    return [row];
  });
}
