// This machine's clock as stamps, and the server's clock estimated from PINGs.
import type {Ping} from '../protocol/server_messages.js';

export const nowNs = (): bigint => BigInt(Math.round(performance.now() * 1e6));

/** The server's clock against this one's: of the last 16 answers the one with the shortest round trip. */
export class ServerClock {
  private readonly answers: {roundTripNs: number; offsetNs: number}[] = [];

  /** `t2Ns`: the reply's header stamp; `t3Ns`: its arrival. */
  add(reply: Ping, t2Ns: number, t3Ns: number): void {
    const t0 = Number(reply.echoedStampNs);
    const t1 = Number(reply.receivedNs);
    this.answers.push({roundTripNs: t3Ns - t0 - (t2Ns - t1), offsetNs: (t1 - t0 + (t2Ns - t3Ns)) / 2});
    if (this.answers.length > 16) this.answers.shift();
  }

  private best(): {roundTripNs: number; offsetNs: number} | null {
    return this.answers.reduce<{roundTripNs: number; offsetNs: number} | null>(
      (best, answer) => (best && best.roundTripNs <= answer.roundTripNs ? best : answer), null);
  }

  get roundTripMs(): number {
    return (this.best()?.roundTripNs ?? NaN) / 1e6;
  }

  /** A server's stamp on this machine's clock, ns; NaN before the first answer. */
  toLocalNs(serverNs: number): number {
    return serverNs - (this.best()?.offsetNs ?? NaN);
  }
}
