// Force against depth and against time, det J and tick time: of the last seconds.
import uPlot from 'uplot';
import type {History} from '../model/history.js';
import {COLOUR, axis, holding, makeChart} from './chart.js';

const WINDOW_S = 30;
const PASS_S = 90;  // of force against depth: nearly the whole history

interface Pass {
  /** In the tissue, mm; 0 outside. */
  depth: number[];
  /** As shown, mm: beyond the template where there is one. */
  shown: number[];
  axial: number[];
  /** Index from which the newest pass of the needle runs. */
  newest: number;
}

export class NeedleCharts {
  private readonly forceDepth: uPlot;
  private readonly forceTime: uPlot;
  private readonly det: uPlot;
  private readonly ticks: uPlot;
  private pass: Pass = {depth: [], shown: [], axial: [], newest: 0};

  constructor(hosts: {forceDepth: HTMLElement; forceTime: HTMLElement; det: HTMLElement; ticks: HTMLElement}) {
    // Depth is not monotonic, and uPlot needs a sorted x: it draws the axes, and drawPass the curve.
    this.forceDepth = makeChart(hosts.forceDepth, {
      scales: {x: {time: false, range: (_, low, high) => [low ?? 0, Math.max(high ?? 0, (low ?? 0) + 40)]}, y: {range: holding(-1, 6)}},
      axes: [axis('depth, mm', 'x'), axis('force, N', 'y')],
      series: [{}, {show: true, stroke: 'transparent', points: {show: false}}],
      hooks: {draw: [(chart) => this.drawPass(chart)]},
    }, [[0], [0]]);
    const time = {time: false} as const;
    const line = (stroke: string, width = 1.5, dash?: number[]): uPlot.Series => ({stroke, width, points: {show: false}, ...(dash ? {dash} : {})});
    this.forceTime = makeChart(hosts.forceTime, {
      scales: {x: time, y: {range: holding(-1, 6)}},
      axes: [axis('time, s', 'x'), axis('force, N', 'y')],
      series: [{}, line(COLOUR.force), line(COLOUR.lateral)],
    }, [[], [], []]);
    this.det = makeChart(hosts.det, {
      scales: {x: time, y: {range: holding(-0.1, 1.1)}},
      axes: [axis('time, s', 'x'), axis('det J', 'y')],
      series: [{}, line(COLOUR.det), line(COLOUR.bound, 1.2, [5, 4])],
      hooks: {draw: [drawZero]},
    }, [[], [], []]);
    this.ticks = makeChart(hosts.ticks, {
      scales: {x: time, y: {range: holding(0, 1)}},
      axes: [axis('time, s', 'x'), axis('tick, ms', 'y')],
      series: [{}, line(COLOUR.det), line(COLOUR.force)],
    }, [[], [], []]);
  }

  /** `templateZ`: of the holes, from which depths are counted; null: from where the tip met the tissue. */
  update(history: History, needle: number, templateZ: number | null): void {
    const to = history.nowS;
    const since = Math.max(0, to - WINDOW_S);
    const series = history.needle(needle);
    this.pass = newestPass(series.slice(to - PASS_S, to), templateZ);
    const bounds = (values: number[], least: number, most: number): number[] =>
      values.reduce((range, value) => [Math.min(range[0]!, value || least), Math.max(range[1]!, value || least)], [least, most]);
    const inTissue = this.pass.shown.filter((_, i) => this.pass.depth[i]! > 0);
    const from = inTissue.length ? Math.floor(Math.min(...inTissue) / 5) * 5 : 0;
    this.forceDepth.setData([bounds(inTissue, from, from + 1), bounds(this.pass.axial, 0, 1)] as uPlot.AlignedData);

    const set = (chart: uPlot, columns: (number | null)[][]): void => {
      chart.batch(() => {
        chart.setData(columns as unknown as uPlot.AlignedData, false);
        chart.setScale('x', {min: since, max: Math.max(to, since + 5)});
      });
    };
    const [times, , axial, lateral] = series.slice(since, to) as [number[], number[], number[], number[]];
    set(this.forceTime, [times, gaps(axial), gaps(lateral)]);
    set(this.det, history.det.slice(since, to).map((column, i) => (i === 0 ? column : gaps(column))));
    set(this.ticks, history.ticks.slice(since, to));
  }

  private drawPass(chart: uPlot): void {
    const {depth, shown, axial, newest} = this.pass;
    const context = chart.ctx;
    context.save();
    context.beginPath();
    context.rect(chart.bbox.left, chart.bbox.top, chart.bbox.width, chart.bbox.height);
    context.clip();
    context.lineWidth = 1.6 * devicePixelRatio;
    for (const [first, end, colour] of [[0, newest, COLOUR.past], [newest, depth.length, COLOUR.force]] as const) {
      context.beginPath();
      let on = false;
      for (let i = first; i < end; ++i) {
        if (!(depth[i]! > 0)) {
          on = false;
          continue;
        }
        const x = chart.valToPos(shown[i]!, 'x', true);
        const y = chart.valToPos(axial[i]!, 'y', true);
        if (on) context.lineTo(x, y);
        else context.moveTo(x, y);
        on = true;
      }
      context.strokeStyle = colour;
      context.stroke();
    }
    const last = depth.length - 1;
    if (depth[last]! > 0) {
      context.beginPath();
      context.arc(chart.valToPos(shown[last]!, 'x', true), chart.valToPos(axial[last]!, 'y', true), 3.5 * devicePixelRatio, 0, 2 * Math.PI);
      context.fillStyle = '#fff';
      context.fill();
    }
    context.restore();
  }
}

/** A pass runs from one time outside the tissue to the next. */
function newestPass([, depth, axial, , tipZ]: number[][], templateZ: number | null): Pass {
  let newest = 0;
  let end = depth!.length;
  while (end > 0 && !(depth![end - 1]! > 0)) --end;  // it may be over already
  for (let i = end - 1; i >= 0 && newest === 0; --i) if (!(depth![i]! > 0)) newest = i + 1;
  return {depth: depth!, shown: templateZ === null ? depth! : tipZ!.map((z) => z - templateZ), axial: axial!, newest};
}

/** uPlot leaves a gap at null. */
const gaps = (values: number[]): (number | null)[] => values.map((value) => (Number.isFinite(value) ? value : null));

/** Where the field would fold. */
function drawZero(chart: uPlot): void {
  const y = chart.valToPos(0, 'y', true);
  const context = chart.ctx;
  context.save();
  context.strokeStyle = COLOUR.warn;
  context.lineWidth = devicePixelRatio;
  context.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
  context.beginPath();
  context.moveTo(chart.bbox.left, y);
  context.lineTo(chart.bbox.left + chart.bbox.width, y);
  context.stroke();
  context.restore();
}
