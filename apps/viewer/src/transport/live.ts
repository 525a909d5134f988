// The connection to a daemon: passes messages to a Session and reconnects automatically.
import type {Session} from '../model/session.js';
import {SOFTWARE, encodeControl, encodeDrop, encodeExercise, encodeHello, type Control} from '../protocol/client_messages.js';
import {encodeContour, type Contour, type ContourSlice} from '../protocol/contour.js';
import {MessageType} from '../protocol/header.js';
import {encodeScanner, type ScannerRequest} from '../protocol/image.js';
import {encodePlanRequest, type PlanNeedle} from '../protocol/plan_message.js';
import type {Message} from '../protocol/message.js';
import {ErrorCode, Role, Subscription, type ServerError} from '../protocol/server_messages.js';
import {nowNs} from './clock.js';
import type {Endpoint} from './endpoint.js';
import {LastMinutes} from './last_minutes.js';
import {Socket} from './socket.js';

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 10000;

export type Status =
  | {phase: 'connecting'; problem: string}
  | {phase: 'open'}
  | {phase: 'waiting'; problem: string; untilMs: number}
  | {phase: 'refused'; problem: string}
  | {phase: 'off'};

export class LiveConnection {
  status: Status = {phase: 'off'};
  /** Called on every change of `status` and every message. */
  onChange: () => void = () => {};
  /** Called with every ERROR: requests of this viewer that were refused. */
  onError: (error: ServerError) => void = () => {};
  onContour: (answer: Contour) => void = () => {};
  /** Called whenever a connection has been accepted that may be to another daemon than the last. */
  onOpen: () => void = () => {};
  reconnects = 0;
  /** What came last, also while it is not shown. */
  readonly lastMinutes = new LastMinutes();
  /** False: what comes is kept in `lastMinutes` and not shown. To show it again, connect(). */
  feeds = true;

  private socket: Socket | null = null;
  private waitMs = FIRST_WAIT_MS;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private volume = false;
  private ultrasound = false;
  private requested = 0;  // the subscription of the last HELLO
  private gapsBefore = 0;
  private asked: Control[] = [];
  /** The connection is made again for other messages of the same daemon. */
  private resubscribes = false;

  constructor(private readonly endpoint: Endpoint, private readonly role: number, private readonly session: Session) {}

  get sequenceGaps(): number {
    return this.gapsBefore + (this.socket?.sequenceGaps ?? 0);
  }
  get roundTripMs(): number {
    return this.socket?.clock.roundTripMs ?? NaN;
  }
  get mayControl(): boolean {
    return this.feeds && this.status.phase === 'open' && this.session.welcome?.role === Role.Operator;
  }

  connect(problem = ''): void {
    clearTimeout(this.timer);
    this.drop();
    this.status = {phase: 'connecting', problem};
    const socket: Socket = new Socket(this.endpoint.url, {
      opened: () => socket.send(MessageType.Hello, encodeHello({
        role: this.role, name: 'viewer', device: null, token: this.endpoint.token, software: SOFTWARE, subscription: this.requested = this.wanted,
      })),
      message: (message, bytes) => this.receive(socket, message, bytes),
      closed: (reason, wasOpen) => {
        if (this.socket === socket) this.lost(reason, wasOpen);
      },
    });
    this.socket = socket;
    this.onChange();
  }

  /** Ends the connection for good, until connect(). */
  end(): void {
    clearTimeout(this.timer);
    this.drop();
    this.resubscribes = false;
    this.status = {phase: 'off'};
    this.onChange();
  }

  /** Whether points inside the tissue are requested too. */
  wantVolume(volume: boolean): void {
    if (this.volume === volume) return;
    this.volume = volume;
    this.resubscribe();
  }

  /** Whether ultrasound images are requested too. */
  wantUltrasound(ultrasound: boolean): void {
    if (this.ultrasound === ultrasound) return;
    this.ultrasound = ultrasound;
    this.resubscribe();
  }

  private get wanted(): number {
    return Subscription.Scene | Subscription.Plan | (this.volume ? 0 : Subscription.Surface) | (this.ultrasound ? Subscription.Ultrasound : 0);
  }

  private resubscribe(): void {
    if (this.status.phase !== 'open') return;  // as soon as it is
    this.resubscribes = true;
    this.connect();
  }

  setScanner(request: ScannerRequest): void {
    this.socket?.send(MessageType.Scanner, encodeScanner(request));
  }

  /** The answer comes as a CONTOUR, or an ERROR. */
  sendContour(slices: readonly ContourSlice[]): void {
    this.socket?.send(MessageType.Contour, encodeContour(slices));
  }

  /** Asks for another rest of the plan; null: for an optimised one. */
  changePlan(change: number, needles: readonly PlanNeedle[] | null): void {
    this.socket?.send(MessageType.Plan, encodePlanRequest(change, needles));
  }

  /** Begins an attempt at an exercise: the daemon goes on with its scene, and this connects again. */
  beginExercise(file: string, trainee: string): void {
    this.socket?.send(MessageType.Exercise, encodeExercise(file, trainee));
  }

  /** Reconnects at once after the page was suspended. */
  wake(): void {
    if (this.status.phase === 'waiting') this.connect(this.status.problem);
  }

  /** Requests made while reconnecting are sent once the connection is open. */
  control(control: Control): void {
    if (this.status.phase === 'connecting') this.asked.push(control);
    else this.socket?.send(MessageType.Control, encodeControl(control));
  }

  /** Presses the button of a needle that the daemon's script moves. */
  press(needle: number, pressed: boolean): void {
    this.socket?.send(MessageType.Drop, encodeDrop(needle, pressed));
  }

  private receive(socket: Socket, message: Message, bytes: Uint8Array): void {
    const nowMs = performance.now();
    this.session.byteRate.add(nowMs, bytes.byteLength);
    this.lastMinutes.add(message, bytes);
    if (!this.feeds) {
      if (message.kind === 'welcome') {
        this.status = {phase: 'open'};
        this.resubscribes = false;
      }
      return;
    }
    const refusal = this.session.apply(message);
    if (refusal) return socket.close(`The daemon sent what does not fit: ${refusal}.`);
    if (message.kind === 'welcome') {
      if (this.status.phase !== 'open') this.status = {phase: 'open'};
      if (!this.resubscribes) this.onOpen();
      this.resubscribes = false;
      this.waitMs = FIRST_WAIT_MS;
      if (this.requested !== this.wanted) return this.resubscribe();  // something else was wanted since HELLO
      this.asked.splice(0).forEach((control) => this.control(control));
    } else if (message.kind === 'frame') {
      const ageMs = (Number(nowNs()) - socket.clock.toLocalNs(message.body.publishNs)) / 1e6;
      this.session.transitMs = Number.isNaN(ageMs) ? 0 : ageMs;
      if (!Number.isNaN(ageMs)) this.session.meshAge.add(ageMs);
    } else if (message.kind === 'contour') {
      this.onContour(message.body);
    } else if (message.kind === 'error' && !message.body.fatal) {
      if (message.body.code === ErrorCode.Shutdown) return;
      this.onError(message.body);
    }
    this.onChange();
  }

  private drop(): void {
    const socket = this.socket;
    this.socket = null;
    this.gapsBefore += socket?.sequenceGaps ?? 0;
    socket?.close('');
  }

  private lost(reason: string, wasOpen: boolean): void {
    const isRefused = this.socket?.fatalCode === ErrorCode.Unauthorised;
    this.gapsBefore += this.socket?.sequenceGaps ?? 0;
    this.socket = null;
    this.resubscribes = false;
    this.reconnects += 1;
    this.asked = [];
    if (isRefused) {  // retrying with the same token would fail again
      this.status = {phase: 'refused', problem: `Access refused: ${reason.replace(/\.$/, '')}.`};
      return this.onChange();
    }
    const {host, port} = new URL(this.endpoint.url);
    const problem = reason ? `Not connected: ${reason.replace(/\.$/, '')}.`
      : wasOpen ? 'The daemon ended the connection.'
      : `No daemon answers at ${host}. Start it with: brachyd --http-port ${port || 80}.`;
    const waitMs = this.waitMs * (0.8 + 0.4 * Math.random());  // viewers of one daemon do not all reconnect at once
    this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
    this.status = {phase: 'waiting', problem, untilMs: performance.now() + waitMs};
    this.timer = setTimeout(() => this.connect(problem), waitMs);
    this.onChange();
  }
}
