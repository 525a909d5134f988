// The manually moved needle: a second connection with the role device.
import {SOFTWARE, encodeDrop, encodeHello, encodePose} from '../protocol/client_messages.js';
import {MessageType} from '../protocol/header.js';
import {ANY_NEEDLE, Role, Subscription} from '../protocol/server_messages.js';
import type {Endpoint} from './endpoint.js';
import {Socket} from './socket.js';

/** Below the 120 poses per second announced in HELLO; forces expire after 50 ms without a pose. */
const PERIOD_MS = 12;
const MOST_SENT = 1000;  // poses that are kept: 12 s

export class Device {
  /** −1 until the daemon has granted one. */
  needle = -1;
  private readonly socket: Socket;
  private readonly sent: {sequence: number; tip: readonly number[]}[] = [];
  private timer: ReturnType<typeof setInterval> | undefined;

  /** `pose` returns the next pose to send, `elapsedS` after the previous one. `ended` is called once, with the reason and the code of
   * the daemon's ERROR (0: none). */
  constructor(endpoint: Endpoint, wanted: number, pose: (elapsedS: number) => Float64Array, ended: (reason: string, code: number) => void,
              granted: () => void) {
    this.socket = new Socket(endpoint.url, {
      opened: () => this.socket.send(MessageType.Hello, encodeHello({
        role: Role.Device, subscription: Subscription.NoMesh, name: 'viewer, by hand',
        device: {needle: wanted < 0 ? ANY_NEEDLE : wanted, rateHz: 30}, token: endpoint.token, software: SOFTWARE,
      })),
      message: (message) => {
        if (message.kind !== 'welcome') return;
        this.needle = message.body.needle;
        granted();
        let before = performance.now();
        this.timer = setInterval(() => {
          const now = performance.now();
          if (this.socket.waiting === 0) this.sendPose(pose((now - before) / 1000));
          before = now;
        }, PERIOD_MS);
      },
      closed: (reason, wasOpen) => {
        clearInterval(this.timer);
        ended(reason || (wasOpen ? 'The daemon ended the connection of the needle.' : 'No daemon answers.'), this.socket.fatalCode);
      },
    });
  }

  /** The device's button went down or up. Returns the message's sequence number. */
  press(pressed: boolean): number {
    return this.socket.send(MessageType.Drop, encodeDrop(this.needle, pressed));
  }

  /** Where the tip was in the last pose up to this message of the connection, mm; null: none is known. */
  tipAt(sequence: number): readonly number[] | null {
    return this.sent.findLast((pose) => pose.sequence <= sequence)?.tip ?? null;
  }

  end(): void {
    this.socket.close('released');
  }

  private sendPose(pose: Float64Array): void {
    const sequence = this.socket.send(MessageType.Pose, encodePose(this.needle, pose));
    this.sent.push({sequence, tip: [3, 7, 11].map((at) => pose[at]!)});
    if (this.sent.length > MOST_SENT) this.sent.shift();
  }
}
