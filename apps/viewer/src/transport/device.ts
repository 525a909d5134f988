// The manually moved needle: a second connection with the role device.
import {SOFTWARE, encodeDrop, encodeHello, encodePose} from '../protocol/client_messages.js';
import {MessageType} from '../protocol/header.js';
import {ANY_NEEDLE, Role, Subscription} from '../protocol/server_messages.js';
import type {Endpoint} from './endpoint.js';
import {Socket} from './socket.js';

/** Below the 120 poses per second announced in HELLO; forces expire after 50 ms without a pose. */
const PERIOD_MS = 12;

export class Device {
  /** −1 until the daemon has granted one. */
  needle = -1;
  private readonly socket: Socket;
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
          if (this.socket.waiting === 0) this.socket.send(MessageType.Pose, encodePose(this.needle, pose((now - before) / 1000)));
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

  end(): void {
    this.socket.close('released');
  }
}
