// Common parts of the charts: style, size and redraw rate.
import uPlot from 'uplot';

export const COLOUR = {
  grid: 'rgba(148, 170, 200, 0.13)', text: '#93a4ba', force: '#ffb454', lateral: '#7aa6ff', det: '#5fd3c6', bound: '#8b7cf6',
  warn: '#ff6b6b', past: 'rgba(255, 180, 84, 0.28)',
};

export function axis(label: string, side: 'x' | 'y', more: Partial<uPlot.Axis> = {}): uPlot.Axis {
  return {
    label, labelSize: side === 'x' ? 15 : 14, labelGap: 0, labelFont: '11px system-ui, sans-serif', font: '10px system-ui, sans-serif',
    stroke: COLOUR.text, size: side === 'x' ? 20 : 34, gap: 3, space: side === 'x' ? 46 : 24,
    grid: {stroke: COLOUR.grid, width: 1}, ticks: {stroke: COLOUR.grid, width: 1, size: 3}, ...more,
  };
}

/** A chart that fills `host`, which has a height of its own. */
export function makeChart(host: HTMLElement, options: Omit<uPlot.Options, 'width' | 'height'>, data: uPlot.AlignedData): uPlot {
  const chart = new uPlot({
    width: Math.max(host.clientWidth, 50), height: Math.max(host.clientHeight, 50), padding: [6, 8, 0, 0], legend: {show: false},
    cursor: {show: false}, select: {show: false, left: 0, top: 0, width: 0, height: 0}, ...options,
  }, data, host);
  new ResizeObserver(() => {
    if (host.clientWidth > 0 && host.clientHeight > 0) chart.setSize({width: host.clientWidth, height: host.clientHeight});
  }).observe(host);
  return chart;
}

/** A range that holds `least` … `most` and the data. */
export const holding = (least: number, most: number) => (_: uPlot, low: number | null, high: number | null): [number, number] =>
  [Math.min(least, low ?? least), Math.max(most, high ?? most)];
