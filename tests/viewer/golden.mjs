// The hex blocks of net/PROTOCOL.md.
import {readFileSync} from 'node:fs';

const page = readFileSync(new URL('../../net/PROTOCOL.md', import.meta.url), 'utf8');

const blocks = new Map([...page.matchAll(/```hex (\w+)\n([\s\S]*?)```/g)].map(([, name, block]) => {
  const digits = block.split('\n').map((line) => line.replace(/#.*/, '')).join(' ').trim().split(/\s+/);
  return [name, Uint8Array.from(digits, (digit) => parseInt(digit, 16))];
}));

/** A recording's file. */
export const goldenRecording = blocks.get('RECORDING');
/** Name → the whole message's bytes. */
export const golden = new Map([...blocks].filter(([name]) => name !== 'RECORDING'));

export const HEADER = 32;
export const bodyOf = (name) => golden.get(name).slice(HEADER);
