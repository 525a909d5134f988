// The real brachyd as a child process, on ports of its own.
import {spawn} from 'node:child_process';
import {createWriteStream} from 'node:fs';
import {createInterface} from 'node:readline';

export class Daemon {
  static running = new Set();

  /** Resolves when it listens. `ports`: those of an earlier one, to come back on them. */
  static async start(config, log, ports = {tcp: 0, http: 0}, more = []) {
    const child = spawn(process.env.BRACHYD ?? 'build/release/bin/brachyd',
                        ['--config', config, '--port', String(ports.tcp), '--http-port', String(ports.http),
                         '--duration', '900', ...more], {stdio: ['ignore', 'pipe', 'pipe']});
    child.stderr.pipe(createWriteStream(log, {flags: 'a'}));
    const ended = new Promise((resolve) => child.once('exit', resolve));
    const found = {};
    for await (const line of createInterface({input: child.stdout})) {
      const port = /^(brachyd listening|https?) on .*:(\d+)$/.exec(line);
      if (port) found[port[1].startsWith('http') ? 'http' : 'tcp'] = Number(port[2]);
      if (port?.[1] === 'https') found.scheme = 'https';
      if (found.http && found.tcp) return new Daemon(child, ended, found);
    }
    throw new Error(`brachyd ended before it listened; see ${log}`);
  }

  constructor(child, ended, ports) {
    this.child = child;
    this.ended = ended;
    this.ports = ports;
    child.stdout.resume();
    Daemon.running.add(this);
  }

  get url() {
    return `${this.ports.scheme ?? 'http'}://127.0.0.1:${this.ports.http}/`;
  }

  async stop() {
    this.child.kill('SIGTERM');
    this.child.kill('SIGCONT');  // where a test has stopped it, and failed
    await this.ended;
    Daemon.running.delete(this);
  }

  /** Also those of tests that failed: the process would wait for them. */
  static async stopAll() {
    for (const daemon of Daemon.running) await daemon.stop();
  }
}
