// The template: a plate with its holes, columns' letters and rows' numbers, drawn once as a picture. It is legible from the
// feet, as a surgeon sees it. Holes of the plan are filled; the chosen one has a ring.
import {CanvasTexture, DoubleSide, LinearMipmapLinearFilter, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace} from 'three';
import {columnName, holeOf, rowName, type SceneMessage} from '../protocol/scene_message.js';

const PIXELS = 1024;

export class TemplatePlate {
  readonly mesh: Mesh;
  private readonly canvas = document.createElement('canvas');
  private readonly texture: CanvasTexture;

  constructor() {
    this.canvas.width = this.canvas.height = PIXELS;
    this.texture = new CanvasTexture(this.canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.anisotropy = 4;
    this.texture.minFilter = LinearMipmapLinearFilter;
    const material = new MeshBasicMaterial({map: this.texture, transparent: true, side: DoubleSide, depthWrite: false});
    this.mesh = new Mesh(new PlaneGeometry(1, 1), material);
    this.mesh.rotation.y = Math.PI;  // its face towards −z
    this.mesh.renderOrder = 2;
    this.mesh.visible = false;
  }

  draw(scene: SceneMessage, planned: readonly string[], chosen: string): void {
    const {origin, spacingMm, columns, rows} = scene.template;
    const cells = Math.max(columns, rows) + 2;
    const cell = PIXELS / cells;
    this.mesh.scale.set(cells * spacingMm, cells * spacingMm, 1);
    this.mesh.position.set(origin[0] + ((columns - 1) / 2) * spacingMm, origin[1] + ((rows - 1) / 2) * spacingMm, origin[2]);

    const context = this.canvas.getContext('2d')!;
    context.clearRect(0, 0, PIXELS, PIXELS);
    // Seen from the feet +x goes to the left.
    const x = (column: number): number => PIXELS / 2 - (column - (columns - 1) / 2) * cell;
    const y = (row: number): number => PIXELS / 2 - (row - (rows - 1) / 2) * cell;
    context.fillStyle = 'rgba(120, 150, 190, 0.07)';
    context.strokeStyle = 'rgba(150, 180, 220, 0.35)';
    context.lineWidth = 3;
    context.beginPath();
    context.roundRect(x(columns - 1) - 1.35 * cell, y(rows - 1) - 1.35 * cell, (columns + 1.7) * cell, (rows + 1.7) * cell, 24);
    context.fill();
    context.stroke();

    context.font = `600 ${Math.round(0.5 * cell)}px system-ui, sans-serif`;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillStyle = 'rgba(205, 220, 240, 0.85)';
    for (let column = 0; column < columns; ++column) context.fillText(columnName(column, scene.template), x(column), y(-0.9));
    for (let row = 0; row < rows; ++row) context.fillText(rowName(row, scene.template), x(columns - 0.1), y(row));

    context.lineWidth = 2;
    for (let column = 0; column < columns; ++column)
      for (let row = 0; row < rows; ++row) {
        context.beginPath();
        context.arc(x(column), y(row), 0.13 * cell, 0, 2 * Math.PI);
        context.strokeStyle = 'rgba(150, 180, 220, 0.55)';
        context.stroke();
      }
    context.fillStyle = 'rgba(95, 211, 198, 0.9)';
    for (const name of planned) {
      const hole = holeOf(name, scene.template);
      if (!hole) continue;
      context.beginPath();
      context.arc(x(hole.column), y(hole.row), 0.15 * cell, 0, 2 * Math.PI);
      context.fill();
    }
    const hole = holeOf(chosen, scene.template);
    if (hole) {
      context.beginPath();
      context.arc(x(hole.column), y(hole.row), 0.36 * cell, 0, 2 * Math.PI);
      context.lineWidth = 5;
      context.strokeStyle = '#ffb454';
      context.stroke();
    }
    this.texture.needsUpdate = true;
  }
}
