// The volume that the daemon serves at /volume: an NRRD of 16-bit words, with the window that fits it.

export interface ShownVolume {
  size: [number, number, number];
  /** Middle of voxel (0, 0, 0), mm, RAS. */
  origin: [number, number, number];
  /** From a voxel to the next along i, j, k; mm, RAS. */
  steps: [number, number, number][];
  /** i fastest; a value is `least` + `step` · word. */
  words: Uint16Array;
  least: number;
  step: number;
  /** Between which most values lie. */
  window: [number, number];
}

const MOST_HEADER_BYTES = 4096;

/** Throws an Error where the bytes are no such volume. */
export function parseVolume(bytes: Uint8Array): ShownVolume {
  const head = new TextDecoder().decode(bytes.subarray(0, MOST_HEADER_BYTES));
  const end = head.indexOf('\n\n');
  if (!head.startsWith('NRRD') || end < 0) throw new Error('the volume is no NRRD');
  const fields = new Map(head.slice(0, end).split('\n').flatMap((line) => {
    const match = /^([^:]+):=?\s*(.*)$/.exec(line);
    return match ? [[match[1]!, match[2]!] as [string, string]] : [];
  }));
  const numbers = (name: string, count: number): number[] => {
    const found = (fields.get(name) ?? '').split(/[\s(),]+/).filter((word) => word !== '').map(Number);
    if (found.length !== count || found.some((value) => !Number.isFinite(value))) throw new Error(`the volume's ${name} is missing or wrong`);
    return found;
  };
  const size = numbers('sizes', 3) as [number, number, number];
  if (!size.every((n) => Number.isInteger(n) && n >= 1 && n <= 2048)) throw new Error("the volume's sizes are wrong");
  const directions = numbers('space directions', 9);
  const count = size[0] * size[1] * size[2];
  const data = bytes.subarray(end + 2);
  if (fields.get('type') !== 'unsigned short' || fields.get('encoding') !== 'raw' || data.length !== 2 * count)
    throw new Error('the volume has other bytes than its header says');
  return {
    size, origin: numbers('space origin', 3) as [number, number, number],
    steps: [0, 3, 6].map((at) => directions.slice(at, at + 3) as [number, number, number]),
    words: new Uint16Array(data.slice().buffer),
    least: numbers('value_least', 1)[0]!, step: numbers('value_step', 1)[0]!,
    window: [numbers('window_least', 1)[0]!, numbers('window_most', 1)[0]!],
  };
}

/** Corners of the box in RAS that holds all of the volume's voxels' middles. */
export function boxOf(volume: ShownVolume): {low: number[]; high: number[]} {
  const low = [...volume.origin];
  const high = [...volume.origin];
  volume.steps.forEach((step, a) => {
    for (let axis = 0; axis < 3; ++axis) {
      const reach = step[axis]! * (volume.size[a]! - 1);
      if (reach < 0) low[axis]! += reach;
      else high[axis]! += reach;
    }
  });
  return {low, high};
}
