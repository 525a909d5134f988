// A recording's file: "BRCYREC1", then messages as they came, each followed by a CRC-32.
import {HEADER_BYTES, decodeHeader} from './header.js';
import {crc32} from './crc32.js';

const MAGIC = 'BRCYREC1';
const CRC_BYTES = 4;

/** Thrown for what is no recording at all; one with a damaged end is read up to there. */
export class NoRecording extends Error {}

export interface Entry {
  type: number;
  stampNs: number;
  /** Header and body, a view into the file. */
  bytes: Uint8Array;
}

/** Walks through a recording's good messages; `damage` says afterwards why it ended before the file did, else ''. */
export class RecordingReader {
  damage = '';
  private at = MAGIC.length;
  private count = 0;
  private readonly view: DataView;

  constructor(private readonly file: Uint8Array) {
    const magic = String.fromCharCode(...file.subarray(0, MAGIC.length));
    if (magic !== MAGIC) throw new NoRecording('This is no brachy recording: it does not start with "BRCYREC1".');
    this.view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  }

  /** 0 … 1, of the file. */
  get progress(): number {
    return this.at / this.file.length;
  }

  next(): Entry | null {
    if (this.damage !== '' || this.at === this.file.length) return null;
    const left = this.file.length - this.at;
    if (left < HEADER_BYTES) return this.end('ends in the middle of a message');
    let header;
    try {
      header = decodeHeader(this.file.subarray(this.at, this.at + HEADER_BYTES));
    } catch {
      return this.end('has a damaged header');
    }
    const size = HEADER_BYTES + header.length;
    if (left < size + CRC_BYTES) return this.end('ends in the middle of a message');
    const bytes = this.file.subarray(this.at, this.at + size);
    if (crc32(bytes) !== this.view.getUint32(this.at + size, true)) return this.end('has a wrong check sum');
    this.at += size + CRC_BYTES;
    this.count += 1;
    return {type: header.type, stampNs: header.stampNs, bytes};
  }

  private end(why: string): null {
    this.damage = `The file ${why} after ${this.count} good messages (byte ${this.at} of ${this.file.length}); it is shown up to there.`;
    return null;
  }
}
