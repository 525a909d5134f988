// "Drop seed": one press drops one seed, whichever applicator the scene has. The page holds the device's button, and draws the needle
// back until a seed falls where none fell at once (a train). The stylet then stays held, so that the next press goes on to the next
// seed of the train, with its spacers.
import type {Session} from '../model/session.js';
import {EventKind} from '../protocol/server_messages.js';

const DRAW_MM_S = 10;   // back, while a seed is awaited
// The needle is drawn so far at most beyond the pose that the last frame is of: where frames come late, the next seed of a train,
// whose length is 4.5 mm, must not fall before the page has seen this one.
const MOST_AHEAD_MM = 1.5;
const LATER_FRAMES = 2;  // after the first that knows of the press: a seed of a magazine is in one of them

/** The needle whose button is pressed. */
export interface Stylet {
  /** Returns the message's sequence number. */
  press(pressed: boolean): number;
  /** Where the hand had the tip in the last pose up to that message, mm; null: not known. */
  tipAt(sequence: number): readonly number[] | null;
  /** False: a script moves the needle, which the page only waits for. */
  readonly canDraw: boolean;
  /** Whether the tip is in front of the gland, where no seed can fall. */
  readonly isOut: boolean;
}

type Phase = 'idle' | 'asked' | 'drawing';

export class SeedDrop {
  /** What it did last, or does now; '': nothing yet. */
  said = '';
  private phase: Phase = 'idle';
  private stylet: Stylet | null = null;
  private needle = 0;
  private isPressed = false;
  private sequence = 0;
  private seeds = 0;
  private events: Session['events'][number] | undefined;
  private framesSince = 0;
  private frame: unknown;

  constructor(private readonly session: Session, private readonly say: (text: string, bad: boolean) => void) {}

  /** Whether the button is down: the stylet holds the rest of a train. */
  get holds(): boolean {
    return this.stylet !== null;
  }
  get isWaiting(): boolean {
    return this.phase !== 'idle';
  }

  begin(stylet: Stylet, needle: number): void {
    this.update();  // a seed that has just come ends the press before
    if (this.isWaiting) return this.letGo('Let go: no further seed falls.');
    this.isPressed = true;
    if (!this.stylet) {
      this.stylet = stylet;
      this.needle = needle;
      this.sequence = stylet.press(true);
      this.phase = 'asked';
    } else {
      this.phase = 'drawing';
    }
    this.seeds = this.fallen;
    this.events = this.session.events.at(-1);
    this.framesSince = 0;
    this.said = stylet.canDraw ? 'Drawing the needle back until a seed falls…' : 'The stylet is held: a seed falls when the needle is drawn back. Press again to let go.';
  }

  /** The trainee's finger is off; a seed that was asked for still falls. */
  end(): void {
    this.isPressed = false;
  }

  /** Ends it: the needle goes on, is let go of, or is lost. */
  letGo(why = ''): void {
    if (!this.stylet) return;
    this.stylet.press(false);
    this.stop();
    this.said = why;
  }

  /** Without a word to the daemon, which has let go by itself. */
  stop(): void {
    this.stylet = null;
    this.phase = 'idle';
    this.isPressed = false;
  }

  /** How far the needle is to be drawn back now, mm. `tip`: to where the hand has drawn it. */
  draw(elapsedS: number, tip: readonly number[]): number {
    if (this.phase !== 'drawing' || !this.stylet?.canDraw) return 0;
    const used = this.forces;
    const shown = used ? this.stylet.tipAt(used.inputSequence) : null;
    const aheadMm = shown ? Math.hypot(...shown.map((value, axis) => value - tip[axis]!)) : 0;
    return Math.max(0, Math.min(DRAW_MM_S * elapsedS, MOST_AHEAD_MM - aheadMm));
  }

  update(): void {
    if (!this.stylet) return;
    const {frame} = this.session;
    if (this.fallen > this.seeds) return this.onSeed();
    if (this.phase === 'idle') return this.stylet.isOut ? this.letGo() : undefined;
    const failure = this.failure();
    if (failure) {
      this.letGo(failure);
      return this.say(failure, true);
    }
    if (frame === this.frame) return;
    this.frame = frame;
    const {forces} = this;
    if (this.phase === 'asked') {
      if (this.stylet.canDraw && (forces ? forces.inputSequence > this.sequence : this.framesSince < 10)) this.framesSince += 1;
      if (this.framesSince > LATER_FRAMES) this.phase = 'drawing';
    } else if (this.stylet.isOut) {
      this.letGo('The needle is out of the tissue, and no seed has fallen.');
      this.say(this.said, true);
    }
  }

  /** Of the needle, in the last frame. */
  private get forces(): {inputSequence: number} | null | undefined {
    return this.session.frame?.needles.find(({id}) => id === this.needle)?.forces;
  }

  private get fallen(): number {
    return this.session.assembler.seeds.filter(({needle}) => needle === this.needle).length;
  }

  private onSeed(): void {
    const seed = this.session.assembler.seeds.filter(({needle}) => needle === this.needle).at(-1)!;
    const depth = this.session.depthBeyondTemplate(seed.dropped);
    const at = depth === null ? '' : `, ${depth.toFixed(1)} mm beyond the template`;
    const isTrain = this.phase !== 'asked' || !this.stylet!.canDraw;
    const left = isTrain ? this.leftOfTrain(seed.planned) : 0;
    this.seeds = this.fallen;
    const text = `Seed ${seed.id} dropped${at}${!isTrain ? '.' : left > 0 ? `; ${left} left in this needle.` : '; the needle is empty.'}`;
    if (!isTrain || left === 0 || !this.stylet!.canDraw) this.letGo(text);
    else if (!this.isPressed) this.phase = 'idle';  // the stylet stays held
    this.said = text;
    this.say(text, false);
  }

  /** Seeds of the plan's needle that `planned` came from and that have not fallen. */
  private leftOfTrain(planned: number): number {
    const all = this.session.plannedSeeds();
    const own = all.get(planned)?.needle;
    const fallen = new Set(this.session.assembler.seeds.map((seed) => seed.planned));
    return [...all].filter(([number, seed]) => seed.needle === own && !fallen.has(number)).length;
  }

  /** Why no seed falls, as the daemon has said since the press. */
  private failure(): string {
    const {events} = this.session;
    const since = this.events ? events.slice(events.lastIndexOf(this.events) + 1) : events;
    const event = since.find(({kind, needle, text}) => needle === this.needle && ((kind === EventKind.Seed && text.startsWith('no seed')) || kind === EventKind.SeedLost));
    return event ? `${event.text[0]!.toUpperCase()}${event.text.slice(1)}.` : '';
  }
}
