// Orientation of the patient: the axes' letters, rotated with the camera.
import {type Camera, Quaternion, Vector3} from 'three';

const AXES: {letter: string; axis: [number, number, number]; colour: string}[] = [
  {letter: 'R', axis: [1, 0, 0], colour: '#ff6b6b'}, {letter: 'L', axis: [-1, 0, 0], colour: '#ff6b6b'},
  {letter: 'A', axis: [0, 1, 0], colour: '#69db8f'}, {letter: 'P', axis: [0, -1, 0], colour: '#69db8f'},
  {letter: 'S', axis: [0, 0, 1], colour: '#6ea8ff'}, {letter: 'I', axis: [0, 0, -1], colour: '#6ea8ff'},
];

export class Gizmo {
  private readonly turn = new Quaternion();
  private readonly ends = AXES.map((axis) => ({...axis, at: new Vector3()}));

  constructor(private readonly canvas: HTMLCanvasElement) {}

  draw(camera: Camera): void {
    const side = this.canvas.clientWidth;
    const scale = Math.min(devicePixelRatio, 2);
    if (this.canvas.width !== side * scale) this.canvas.width = this.canvas.height = side * scale;
    const context = this.canvas.getContext('2d')!;
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, side, side);
    context.font = '600 11px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    this.turn.copy(camera.quaternion).invert();
    for (const end of this.ends) end.at.fromArray(end.axis).applyQuaternion(this.turn);
    const reach = side / 2 - 12;
    for (const end of this.ends.sort((a, b) => a.at.z - b.at.z)) {
      const x = side / 2 + reach * end.at.x;
      const y = side / 2 - reach * end.at.y;
      const positive = end.axis[0] + end.axis[1] + end.axis[2] > 0;
      context.globalAlpha = 0.45 + 0.55 * ((end.at.z + 1) / 2);
      context.strokeStyle = context.fillStyle = end.colour;
      if (positive) {
        context.lineWidth = 2;
        context.beginPath();
        context.moveTo(side / 2, side / 2);
        context.lineTo(x, y);
        context.stroke();
      }
      context.beginPath();
      context.arc(x, y, 9, 0, 2 * Math.PI);
      if (positive) context.fill();
      else {
        context.fillStyle = '#121a26';
        context.fill();
        context.lineWidth = 1.2;
        context.stroke();
      }
      context.fillStyle = positive ? '#0b111a' : end.colour;
      context.fillText(end.letter, x, y + 0.5);
    }
    context.globalAlpha = 1;
  }
}
