// A viewer over TCP, as the tools are: what the page shows is compared with what this one gets.
import net from 'node:net';
import {viewer} from './viewer_module.mjs';

const HEADER = 32;
const now = () => BigInt(Math.round(performance.now() * 1e6));

export class NativeClient {
  mesh = new viewer.FrameAssembler();
  /** Mesh by tick, of the last few seconds. */
  meshes = new Map();
  /** Whole messages as they came. */
  messages = [];
  #sent = 0;
  #waiting = Buffer.alloc(0);

  constructor(port, subscription) {
    this.socket = net.connect(port, '127.0.0.1', () =>
      this.#send(1, viewer.encodeHello({role: 1, subscription, name: 'test', device: null})));
    this.socket.on('data', (data) => this.#receive(data));
    this.socket.on('error', () => {});  // the daemon ends in some tests
  }

  end() {
    this.socket.destroy();
  }

  #send(type, body) {
    this.socket.write(viewer.encodeMessage(type, ++this.#sent, now(), body));
  }

  #receive(data) {
    this.#waiting = Buffer.concat([this.#waiting, data]);
    while (this.#waiting.length >= HEADER) {
      const length = HEADER + this.#waiting.readUInt32LE(12);
      if (this.#waiting.length < length) return;
      const bytes = Buffer.from(this.#waiting.subarray(0, length));
      this.#waiting = this.#waiting.subarray(length);
      this.#take(bytes, viewer.decodeMessage(new Uint8Array(bytes)));
    }
  }

  #take(bytes, message) {
    if (message.kind === 'ping')
      return this.#send(9, viewer.encodePing(message.body.nonce, {echoedStampNs: message.header.stampExact, receivedNs: now()}));
    this.messages.push(bytes);
    if (message.kind === 'state') this.state = message.body;
    if (message.kind === 'topology') this.mesh.start(message.body);
    if (message.kind !== 'frame') return;
    const refusal = this.mesh.apply(message.body);
    if (refusal) throw new Error(refusal);
    this.meshes.set(message.body.tick, this.mesh.positions.slice());
    if (this.meshes.size > 200) this.meshes.delete(this.meshes.keys().next().value);
  }
}
