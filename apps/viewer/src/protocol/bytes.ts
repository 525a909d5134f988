// Little-endian reading and writing of message bodies, for wire_generated.ts. A reader throws ProtocolError on the first thing that is wrong.

export class ProtocolError extends Error {}

export type Vec3 = [number, number, number];

const utf8 = new TextDecoder('utf-8', {fatal: true});

export class ByteReader {
  private readonly view: DataView;
  private at = 0;

  constructor(private readonly bytes: Uint8Array) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get remaining(): number {
    return this.bytes.byteLength - this.at;
  }

  private take(count: number): number {
    if (count > this.remaining) throw new ProtocolError('the body is too short');
    const from = this.at;
    this.at += count;
    return from;
  }

  u8(): number {
    return this.view.getUint8(this.take(1));
  }
  u16(): number {
    return this.view.getUint16(this.take(2), true);
  }
  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }
  i32(): number {
    return this.view.getInt32(this.take(4), true);
  }
  /** Counts, ticks and stamps as a number: exact up to 2^53, which is 104 days in nanoseconds. */
  u64(): number {
    const low = this.u32();
    return this.u32() * 4294967296 + low;
  }
  /** What must come back bit for bit: hashes and stamps that are echoed. */
  u64Exact(): bigint {
    return this.view.getBigUint64(this.take(8), true);
  }
  f32(): number {
    return this.view.getFloat32(this.take(4), true);
  }
  f64(): number {
    return this.view.getFloat64(this.take(8), true);
  }
  boolean(name: string): boolean {
    const value = this.u8();
    if (value > 1) throw new ProtocolError(`${name} is neither 0 nor 1`);
    return value === 1;
  }
  vec3(): Vec3 {
    return [this.f64(), this.f64(), this.f64()];
  }
  /** Twelve f64: the 3×4 matrix [R | p] row by row. */
  pose(): Float64Array {
    const pose = new Float64Array(12);
    for (let i = 0; i < 12; ++i) pose[i] = this.f64();
    return pose;
  }
  skip(count: number): void {
    this.take(count);
  }
  part(count: number): Uint8Array {
    const from = this.take(count);
    return this.bytes.subarray(from, from + count);
  }
  f32Array(count: number): Float32Array {
    const part = this.part(4 * count);
    return new Float32Array(part.slice().buffer);
  }
  u32Array(count: number): Uint32Array {
    const part = this.part(4 * count);
    return new Uint32Array(part.slice().buffer);
  }
  text(): string {
    const part = this.part(this.u16());
    let text: string;
    try {
      text = utf8.decode(part);
    } catch {
      throw new ProtocolError('a text is not UTF-8');
    }
    if (/[\u0000-\u001f\u007f-\u009f]/.test(text)) throw new ProtocolError('a text has control characters');
    return text;
  }
  /** As many as a count of the body says; it is believed only if that many entries of at least `leastBytes` can still follow. */
  list<T>(count: number, leastBytes: number, read: () => T): T[] {
    if (count * leastBytes > this.remaining) throw new ProtocolError('a count is larger than the body');
    const list: T[] = [];
    for (let i = 0; i < count; ++i) list.push(read());
    return list;
  }
  /** The sections that end a body: `read` gets those it may know, each with a reader of its own. */
  sections(read: (id: number, section: ByteReader) => boolean): void {
    const count = this.u16();
    this.u16();
    for (let i = 0; i < count; ++i) {
      const id = this.u16();
      this.u16();
      const section = new ByteReader(this.part(this.u32()));
      if (read(id, section)) section.finish();
    }
  }
  finish(): void {
    if (this.remaining !== 0) throw new ProtocolError('bytes are left over in a body');
  }
}

export class ByteWriter {
  private bytes = new Uint8Array(256);
  private view = new DataView(this.bytes.buffer);
  private size = 0;

  /** Before `view` is used: it may be another one afterwards. */
  private take(count: number): number {
    if (this.size + count > this.bytes.length) {
      const larger = new Uint8Array(2 * (this.size + count));
      larger.set(this.bytes);
      this.bytes = larger;
      this.view = new DataView(larger.buffer);
    }
    const from = this.size;
    this.size += count;
    return from;
  }

  u8(value: number): void {
    const at = this.take(1);
    this.view.setUint8(at, value);
  }
  u16(value: number): void {
    const at = this.take(2);
    this.view.setUint16(at, value, true);
  }
  u32(value: number): void {
    const at = this.take(4);
    this.view.setUint32(at, value, true);
  }
  i32(value: number): void {
    const at = this.take(4);
    this.view.setInt32(at, value, true);
  }
  u64(value: bigint): void {
    const at = this.take(8);
    this.view.setBigUint64(at, value, true);
  }
  f32(value: number): void {
    const at = this.take(4);
    this.view.setFloat32(at, value, true);
  }
  f64(value: number): void {
    const at = this.take(8);  // first: it may make a larger view
    this.view.setFloat64(at, value, true);
  }
  /** X, 3×4 row by row. */
  pose(pose: ArrayLike<number>): void {
    for (let i = 0; i < 12; ++i) this.f64(pose[i]!);
  }
  array(values: Float32Array | Uint32Array): void {
    this.raw(new Uint8Array(values.buffer, values.byteOffset, values.byteLength));
  }
  raw(bytes: Uint8Array): void {
    const from = this.take(bytes.length);
    this.bytes.set(bytes, from);
  }
  text(text: string): void {
    const encoded = new TextEncoder().encode(text);
    this.u16(encoded.length);
    this.raw(encoded);
  }
  zeros(count: number): void {
    for (let i = 0; i < count; ++i) this.u8(0);
  }
  /** The list of sections that ends a body; null: it is absent. */
  sections(sections: ([number, Uint8Array] | null)[]): void {
    const present = sections.filter((one) => one !== null);
    this.u32(present.length);
    for (const [id, bytes] of present) {
      this.u32(id);
      this.u32(bytes.length);
      this.raw(bytes);
    }
  }
  result(): Uint8Array<ArrayBuffer> {
    return this.bytes.slice(0, this.size);
  }
}

/** The bytes that `write` writes of a value. */
export function encoded<T>(write: (writer: ByteWriter, value: T) => void, value: T): Uint8Array<ArrayBuffer> {
  const writer = new ByteWriter();
  write(writer, value);
  return writer.result();
}

/** For ByteWriter.sections. */
export function section<T>(id: number, value: T | null | undefined, write: (writer: ByteWriter, value: T) => void): [number, Uint8Array] | null {
  return value == null ? null : [id, encoded(write, value)];
}
