// One array's image on a canvas, with the template's holes, calipers and an outline over it.
import type {UltrasoundImage} from '../protocol/image.js';
import {columnName, holeOf, rowName, type TemplateGrid} from '../protocol/scene_message.js';
import {distanceMm, templateMarks, type Outline, type Pixel} from './geometry.js';

const CALIPER = '#ffd166';
const OUTLINE = '#5fd3c6';
const TRUTH = '#ff8a7a';
const REACH_PX = 9;  // CSS, of a press from what it means
const MOST_CALIPERS = 2;
const ARRAY_NAMES = ['', 'transverse', 'sagittal', 'end-fire'];

/** Gray as a pixel of ImageData, little-endian RGBA. */
const GRAYS = Uint32Array.from({length: 256}, (_, g) => (0xff000000 | (g << 16) | (g << 8) | g) >>> 0);

export interface Caliper {
  from: Pixel;
  to: Pixel;
}

export interface Overlay {
  grid: boolean;
  template: TemplateGrid | null;
  /** The chosen one; '': none. */
  hole: string;
  /** Planned seeds in the plane. */
  seeds: readonly Pixel[];
  outline: Outline;
}

/** Takes what is pressed before the calipers do. */
export interface Editor {
  /** False: it is not its own. `reach`: pixels within which something is meant. */
  press: (image: UltrasoundImage, at: Pixel, reach: number) => boolean;
  drag: (image: UltrasoundImage, at: Pixel) => void;
  release: () => void;
}

const NO_OUTLINE: Outline = {points: [], selected: -1, curve: [], truth: []};

export class Screen {
  calipers: Caliper[] = [];
  editor: Editor | null = null;
  drawn = 0;

  private readonly context: CanvasRenderingContext2D;
  private data: ImageData | null = null;
  private readonly source = document.createElement('canvas');
  private image: UltrasoundImage | null = null;
  private overlay: Overlay = {grid: true, template: null, hole: '', seeds: [], outline: NO_OUTLINE};
  private isEditing = false;
  private moving: Caliper | null = null;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext('2d')!;
    canvas.addEventListener('pointerdown', (event) => this.press(event));
    canvas.addEventListener('pointermove', (event) => this.drag(event));
    for (const end of ['pointerup', 'pointercancel'])
      canvas.addEventListener(end, () => {
        this.moving = null;
        if (this.isEditing) this.editor?.release();
        this.isEditing = false;
      });
  }

  show(image: UltrasoundImage, overlay: Overlay): void {
    if (this.image !== image) this.copy(image);
    this.image = image;
    this.overlay = overlay;
    this.draw();
    this.drawn += 1;
  }

  get shownImage(): UltrasoundImage | null {
    return this.image;
  }

  private copy(image: UltrasoundImage): void {
    if (!this.data || this.data.width !== image.width || this.data.height !== image.height) {
      this.data = new ImageData(image.width, image.height);
      this.source.width = this.canvas.width = image.width;
      this.source.height = this.canvas.height = image.height;
    }
    const out = new Uint32Array(this.data.data.buffer);
    for (let i = 0; i < image.pixels.length; ++i) out[i] = GRAYS[image.pixels[i]!]!;
    this.source.getContext('2d')!.putImageData(this.data, 0, 0);
  }

  /** Image pixels of one CSS pixel. */
  private get pixelsEach(): number {
    const box = this.canvas.getBoundingClientRect();
    return 1 / Math.min(box.width / this.canvas.width, box.height / this.canvas.height);
  }

  /** CSS pixels to the image's: the canvas shows the image whole, in its middle. */
  private at(event: PointerEvent): Pixel {
    const box = this.canvas.getBoundingClientRect();
    const scale = Math.min(box.width / this.canvas.width, box.height / this.canvas.height);
    return {
      x: (event.clientX - box.left - (box.width - scale * this.canvas.width) / 2) / scale - 0.5,
      y: (event.clientY - box.top - (box.height - scale * this.canvas.height) / 2) / scale - 0.5,
    };
  }

  private press(event: PointerEvent): void {
    if (!this.image || event.button !== 0) return;
    const at = this.at(event);
    this.canvas.setPointerCapture(event.pointerId);
    this.isEditing = this.editor?.press(this.image, at, REACH_PX * this.pixelsEach) ?? false;
    if (this.isEditing) return;
    this.moving = {from: at, to: at};
    this.calipers = [...this.calipers, this.moving].slice(-MOST_CALIPERS);
  }

  private drag(event: PointerEvent): void {
    if (this.isEditing && this.image) return this.editor?.drag(this.image, this.at(event));
    if (!this.moving) return;
    this.moving.to = this.at(event);
    this.draw();
  }

  private draw(): void {
    const {image, context} = this;
    if (!image) return;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.shadowBlur = 0;
    context.drawImage(this.source, 0, 0);
    context.translate(0.5, 0.5);  // now 0, 0 is the middle of the first pixel
    const unit = image.width / Math.min(512, Math.max(100, this.canvas.clientWidth));  // of lines and letters, as large as on the page
    context.textBaseline = 'middle';
    context.shadowColor = '#000';  // legible on bright tissue
    context.shadowBlur = 2 * unit;
    if (this.overlay.grid && this.overlay.template) this.drawGrid(image, this.overlay.template, unit);
    this.drawSeeds(unit);
    this.drawOutline(unit);
    this.drawCalipers(image, unit);
    this.drawScale(image, unit);
    context.font = `${14 * unit}px system-ui, sans-serif`;
    context.textAlign = 'left';
    context.fillStyle = '#b9c7d9';
    context.fillText(ARRAY_NAMES[image.array] ?? '', 8 * unit, 14 * unit);
    if (!image.held && !image.frozen && !image.uncertified) return;
    context.font = `600 ${18 * unit}px system-ui, sans-serif`;
    context.textAlign = 'right';
    context.fillStyle = image.frozen ? '#7ec8ff' : '#ffb454';
    context.fillText(image.frozen ? '❄ frozen' : image.held ? '‖ held: the field folds' : 'field not certified', image.width - 8 * unit, 16 * unit);
  }

  private drawGrid(image: UltrasoundImage, template: TemplateGrid, unit: number): void {
    const {context} = this;
    context.fillStyle = context.strokeStyle = 'rgba(150, 215, 255, 0.75)';
    context.lineWidth = unit;
    context.font = `${11 * unit}px system-ui, sans-serif`;
    context.textAlign = 'center';
    const chosen = holeOf(this.overlay.hole, template);
    for (const mark of templateMarks(image, template)) {
      const isChosen = chosen !== null && mark.column === chosen.column && mark.row === chosen.row;
      context.fillStyle = context.strokeStyle = isChosen ? '#ffb454' : 'rgba(150, 215, 255, 0.75)';
      if (mark.kind === 'line') {
        context.globalAlpha = isChosen ? 0.9 : 0.45;
        context.beginPath();
        context.moveTo(mark.from.x, mark.from.y);
        context.lineTo(mark.to.x, mark.to.y);
        context.stroke();
        context.globalAlpha = 1;
        // Its row's number at the right side of the image.
        const [dx, dy] = [mark.to.x - mark.from.x, mark.to.y - mark.from.y];
        if (Math.abs(dx) > Math.abs(dy))
          context.fillText(rowName(mark.row, template), image.width - 10 * unit, mark.from.y + (dy * (image.width - 10 * unit - mark.from.x)) / dx);
        continue;
      }
      const {x, y} = mark.at;
      context.beginPath();
      context.arc(x, y, (isChosen ? 6 : 1.6) * unit, 0, 2 * Math.PI);
      if (isChosen) context.stroke();
      else context.fill();
      if (mark.row === 0) context.fillText(columnName(mark.column, template), x, y + 11 * unit);
      if (mark.column === 0) context.fillText(rowName(mark.row, template), x + 12 * unit * Math.sign(x - image.width / 2), y);
    }
  }

  private drawSeeds(unit: number): void {
    const {context} = this;
    context.strokeStyle = '#ffd166';
    context.lineWidth = 1.5 * unit;
    for (const {x, y} of this.overlay.seeds) {
      context.beginPath();
      context.arc(x, y, 5 * unit, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  private drawOutline(unit: number): void {
    const {context} = this;
    const {points, selected, curve, truth} = this.overlay.outline;
    const line = (along: readonly Pixel[]): void => {
      context.beginPath();
      along.forEach(({x, y}, i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
      if (along.length > 2) context.closePath();
      context.stroke();
    };
    context.lineWidth = 1.5 * unit;
    context.strokeStyle = TRUTH;
    context.setLineDash([5 * unit, 4 * unit]);
    truth.forEach(line);
    context.setLineDash([]);
    context.strokeStyle = context.fillStyle = OUTLINE;
    line(curve);
    points.forEach(({x, y}, i) => {
      const half = (i === selected ? 4 : 2.5) * unit;
      context.fillStyle = i === selected ? '#fff' : OUTLINE;
      context.fillRect(x - half, y - half, 2 * half, 2 * half);
    });
  }

  private drawCalipers(image: UltrasoundImage, unit: number): void {
    const {context} = this;
    context.strokeStyle = context.fillStyle = CALIPER;
    context.lineWidth = 1.5 * unit;
    context.font = `600 ${14 * unit}px system-ui, sans-serif`;
    context.textAlign = 'left';
    for (const {from, to} of this.calipers) {
      context.setLineDash([4 * unit, 4 * unit]);
      context.beginPath();
      context.moveTo(from.x, from.y);
      context.lineTo(to.x, to.y);
      context.stroke();
      context.setLineDash([]);
      context.beginPath();
      for (const {x, y} of [from, to]) {
        context.moveTo(x - 6 * unit, y);
        context.lineTo(x + 6 * unit, y);
        context.moveTo(x, y - 6 * unit);
        context.lineTo(x, y + 6 * unit);
      }
      context.stroke();
      context.fillText(`${distanceMm(image, from, to).toFixed(1)} mm`, to.x + 8 * unit, to.y - 8 * unit);
    }
  }

  /** Centimetres along the left side, from the array's edge below, with a number at each. */
  private drawScale(image: UltrasoundImage, unit: number): void {
    const {context} = this;
    context.strokeStyle = 'rgba(185, 199, 217, 0.8)';
    context.fillStyle = '#cfdaea';
    context.lineWidth = unit;
    context.font = `${11 * unit}px system-ui, sans-serif`;
    context.textAlign = 'left';
    const last = Math.floor((image.height * image.spacingMm) / 10);
    const y = (mm: number): number => image.height - 1 - mm / image.spacingMm;
    context.beginPath();
    for (let mm = 0; mm < image.height * image.spacingMm; mm += 5) {
      context.moveTo(0, y(mm));
      context.lineTo((mm % 10 === 0 ? 8 : 4) * unit, y(mm));
    }
    context.stroke();
    for (let cm = 1; cm <= last; ++cm)
      if (y(10 * cm) > 26 * unit) context.fillText(cm === 1 ? '1 cm' : String(cm), 11 * unit, y(10 * cm));
  }
}
