// One WebSocket with the protocol: numbers outgoing messages, checks incoming ones, answers PINGs.
import {ProtocolError} from '../protocol/bytes.js';
import {encodePing} from '../protocol/client_messages.js';
import {MessageType, encodeMessage} from '../protocol/header.js';
import {decodeMessage, type Message} from '../protocol/message.js';
import {ServerClock, nowNs} from './clock.js';

export interface SocketHandlers {
  opened(): void;
  /** `bytes`: the message as it came, header and body. */
  message(message: Message, bytes: Uint8Array): void;
  /** Called once, when the connection has ended. `reason` is readable text; '' where the other side gave none. */
  closed(reason: string, wasOpen: boolean): void;
}

export class Socket {
  readonly clock = new ServerClock();
  sequenceGaps = 0;
  /** Code of the fatal ERROR received; 0: none. */
  fatalCode = 0;
  private readonly socket: WebSocket;
  private sent = 0;
  private received = 0;
  private reason = '';
  private wasOpen = false;
  private over = false;
  private readonly pinging: ReturnType<typeof setInterval>;

  constructor(url: string, private readonly handlers: SocketHandlers) {
    this.socket = new WebSocket(url);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => {
      this.wasOpen = true;
      handlers.opened();
    };
    this.socket.onmessage = (event) => this.receive(event.data as ArrayBuffer);
    this.socket.onclose = () => this.finish();
    this.pinging = setInterval(() => this.send(MessageType.Ping, encodePing(BigInt(this.sent), null)), 1000);
  }

  /** Bytes queued for sending. */
  get waiting(): number {
    return this.socket.bufferedAmount;
  }

  /** Returns the message's sequence number, 0 where it cannot be sent. */
  send(type: number, body: Uint8Array, stampNs: bigint = nowNs()): number {
    if (this.socket.readyState !== WebSocket.OPEN) return 0;
    this.sent += 1;
    this.socket.send(encodeMessage(type, this.sent, stampNs, body));
    return this.sent;
  }

  close(reason: string): void {
    this.reason ||= reason;
    this.socket.close();
    this.finish();  // the browser reports a vanished peer only after a long time
  }

  private finish(): void {
    if (this.over) return;
    this.over = true;
    clearInterval(this.pinging);
    this.socket.onmessage = null;
    this.handlers.closed(this.reason, this.wasOpen);
  }

  private receive(data: ArrayBuffer): void {
    const arrivedNs = nowNs();
    try {
      const bytes = new Uint8Array(data);
      const message = decodeMessage(bytes);
      this.received += 1;
      if (message.header.sequence !== this.received) {
        this.sequenceGaps += 1;
        throw new ProtocolError(`message ${message.header.sequence} came where ${this.received} was due`);
      }
      if (message.kind === 'ping') return this.ping(message, arrivedNs);
      if (message.kind === 'error' && message.body.fatal) {
        this.reason = message.body.text;
        this.fatalCode = message.body.code;
      }
      this.handlers.message(message, bytes);
    } catch (error) {
      if (!(error instanceof ProtocolError)) throw error;
      this.close(`What came is no message this viewer understands: ${error.message}.`);
    }
  }

  private ping(message: Message & {kind: 'ping'}, arrivedNs: bigint): void {
    if (message.body.reply) return this.clock.add(message.body, message.header.stampNs, Number(arrivedNs));
    this.send(MessageType.Ping, encodePing(message.body.nonce, {echoedStampNs: message.header.stampExact, receivedNs: arrivedNs}));
  }
}
