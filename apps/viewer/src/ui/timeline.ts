// The marks of a recording on its time line: each kind has a row, a colour and a shape of its own.
import {MARK_KINDS, type Mark, type MarkKind} from '../model/marks.js';
import {clock} from './time.js';

type Draw = (context: CanvasRenderingContext2D, x: number, y: number) => void;

const polygon = (...corners: [number, number][]): Draw => (context, x, y) => {
  context.beginPath();
  for (const [dx, dy] of corners) context.lineTo(x + dx, y + dy);
  context.fill();
};
const SHAPES: Record<MarkKind, {colour: string; name: [string, string]; draw: Draw}> = {
  finding: {colour: '#ff7b72', name: ['finding', 'findings'], draw: polygon([-6, -6], [6, -6], [0, 6])},
  organ: {colour: '#ffb454', name: ['organ', 'organs'], draw: polygon([-5, -5], [5, -5], [5, 5], [-5, 5])},
  lost: {colour: '#ffb454', name: ['lost seed', 'lost seeds'], draw: polygon([-6, -4], [-4, -6], [6, 4], [4, 6])},
  drop: {colour: '#ffe3a1', name: ['seed', 'seeds'], draw: (context, x, y) => {
    context.beginPath();
    context.arc(x, y, 4, 0, 7);
    context.fill();
  }},
  puncture: {colour: '#7aa6ff', name: ['puncture', 'punctures'], draw: polygon([-2, -6], [2, -6], [2, 6], [-2, 6])},
  missed: {colour: '#93a4ba', name: ['missed ticks', 'missed ticks'], draw: polygon([-4, 1], [4, 1], [4, 4], [-4, 4])},
};
/** Of the slider below: half of its thumb. */
const MARGIN_PX = 8;
const NEAR_PX = 12;

export class Timeline {
  private marks: readonly Mark[] = [];
  private durationS = 0;
  private drawn = '';
  private version = 0;

  /** `go`: a mark was chosen, or another place. */
  constructor(private readonly canvas: HTMLCanvasElement, go: (timeS: number) => void) {
    canvas.addEventListener('click', (event) => {
      const mark = this.near(event.offsetX);
      const share = (event.offsetX - MARGIN_PX) / Math.max(1, this.canvas.clientWidth - 2 * MARGIN_PX);
      go(mark ? mark.timeS : share * this.durationS);
    });
    canvas.addEventListener('pointermove', (event) => {
      const mark = this.near(event.offsetX);
      this.canvas.title = mark ? `${clock(mark.timeS)} ${mark.text}` : '';
    });
  }

  show(marks: readonly Mark[], durationS: number): void {
    this.marks = marks;
    this.durationS = durationS;
    this.version += 1;
    const said = MARK_KINDS.flatMap((kind) => {
      const count = marks.filter((mark) => mark.kind === kind).length;
      return count > 0 ? `${count} ${SHAPES[kind].name[count === 1 ? 0 : 1]}` : [];
    });
    this.canvas.setAttribute('aria-label', `Marks of the recording: ${said.join(', ') || 'none'}`);
  }

  draw(positionS: number): void {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const now = `${width} ${height} ${devicePixelRatio} ${this.version} ${positionS.toFixed(2)}`;
    if (now === this.drawn || width === 0) return;
    this.drawn = now;
    this.canvas.width = Math.round(width * devicePixelRatio);
    this.canvas.height = Math.round(height * devicePixelRatio);
    const context = this.canvas.getContext('2d')!;
    context.scale(devicePixelRatio, devicePixelRatio);
    // The important ones last, over the others; findings in a row of their own.
    for (const kind of [...MARK_KINDS].reverse()) {
      context.fillStyle = SHAPES[kind].colour;
      for (const mark of this.marks) if (mark.kind === kind) SHAPES[kind].draw(context, this.x(mark.timeS), kind === 'finding' ? 8 : height - 9);
    }
    context.fillStyle = '#e4ecf5';
    context.fillRect(this.x(positionS) - 0.5, 0, 1, height);
  }

  private x(timeS: number): number {
    return MARGIN_PX + (this.durationS > 0 ? timeS / this.durationS : 0) * (this.canvas.clientWidth - 2 * MARGIN_PX);
  }

  /** The nearest, of two as near the more important one. */
  private near(x: number): Mark | null {
    let nearest: Mark | null = null;
    let least = NEAR_PX;
    for (const kind of MARK_KINDS)
      for (const mark of this.marks) {
        const apart = Math.abs(this.x(mark.timeS) - x);
        if (mark.kind !== kind || apart >= least) continue;
        nearest = mark;
        least = apart;
      }
    return nearest;
  }
}

/** What the shapes mean, in a row. */
export function showLegend(host: HTMLElement): void {
  host.replaceChildren(...MARK_KINDS.map((kind) => {
    const label = document.createElement('span');
    const picture = document.createElement('canvas');
    picture.width = picture.height = 14;
    picture.setAttribute('aria-hidden', 'true');
    const context = picture.getContext('2d')!;
    context.fillStyle = SHAPES[kind].colour;
    SHAPES[kind].draw(context, 7, 7);
    label.append(picture, SHAPES[kind].name[1]);
    return label;
  }));
}
