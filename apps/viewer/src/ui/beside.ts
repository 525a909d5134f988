// A second attempt beside the first: a view of its own with the same camera, on the same clock.
import type {PerspectiveCamera} from 'three';
import {Session} from '../model/session.js';
import type {Settings} from '../model/settings.js';
import {Viewport} from '../scene/viewport.js';
import {Player} from '../transport/player.js';
import {byId, setText} from './dom.js';

export class Beside {
  player: Player | null = null;
  private readonly session = new Session();
  private viewport: Viewport | null = null;

  constructor(private readonly settings: Settings) {}

  /** Throws NoRecording. */
  async open(name: string, bytes: Uint8Array, shown: string): Promise<void> {
    byId('stage-beside').hidden = false;  // a view has a size before its canvas has one
    try {
      this.viewport ??= new Viewport(byId<HTMLCanvasElement>('scene-beside'), this.session, this.settings);
      this.player = await Player.open(name, bytes, this.session, () => {});
    } catch (error) {
      this.close();
      throw error;
    }
    setText(byId('beside-name'), shown);
    byId('scene-beside').setAttribute('aria-label', `The attempt beside it in three dimensions: ${shown}`);
  }

  close(): void {
    this.player = null;
    byId('stage-beside').hidden = true;
  }

  /** Shows it at the other's time. */
  draw(positionS: number, camera: PerspectiveCamera, nowMs: number): void {
    if (!this.player || !this.viewport) return;
    const wanted = Math.min(positionS, this.player.durationS);
    if (wanted !== this.player.positionS) this.player.seek(wanted);
    this.viewport.draw(nowMs);
    this.viewport.follow(camera);
  }
}
