// Keys: none is bound twice, and the documents name those that there are.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {test} from 'node:test';
import {viewer} from './viewer_module.mjs';

const read = (path) => readFileSync(new URL(`../../apps/viewer/${path}`, import.meta.url), 'utf8');
/** Those of the page: [key, what it does]. */
const bound = [...read('src/main.ts').matchAll(/^  \{key: '([^']+)'(?:, shown: '[^']*')?, does: '([^']*)'/gm)].map(([, key, does]) => ({key, does}));

test('no key of the page is bound twice', () => {
  assert.equal(bound.length, (read('src/main.ts').match(/\{key: '/g) ?? []).length, 'each shortcut is read');
  assert.ok(bound.length > 40);
  assert.equal(viewer.shortcutsByKey(bound).size, bound.length);
  assert.deepEqual(bound.filter(({does}) => ['plan', 'loop the script'].includes(does)),
                   [{key: 'k', does: 'loop the script'}, {key: 'l', does: 'plan'}]);
});

test('a key that is bound twice, or that no event has, is an error', () => {
  assert.throws(() => viewer.shortcutsByKey([{key: 'l', does: 'loop'}, {key: 'l', does: 'plan'}]), /"l" is bound twice: "loop" and "plan"/);
  assert.throws(() => viewer.shortcutsByKey([{key: 'L', does: 'loop'}]), /lower case/);
});

test('the keys that the document and the buttons name are bound, and to what they say', () => {
  const keys = new Map(bound.map(({key, does}) => [key, does]));
  const page = [...read('src/index.html').matchAll(/title="([^"]*) \(([A-Z])\)[^"]*"/g)].map(([, says, key]) => ({says, key: key.toLowerCase()}));
  const named = [...read('README.md').matchAll(/`([A-Z])`/g)].map(([, key]) => key.toLowerCase());
  assert.ok(page.length >= 4 && named.includes('l') && named.includes('k'));
  for (const key of [...named, ...page.map((button) => button.key)]) assert.ok(keys.has(key), `${key} is named and not bound`);
  assert.equal(page.find(({says}) => says === 'Repeat the script')?.key, 'k');
});
