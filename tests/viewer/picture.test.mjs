// Pictures of a simulation that misses ticks are not stored.
import assert from 'node:assert/strict';
import {existsSync, mkdirSync, readFileSync, rmSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {test} from 'node:test';
import {refusal, storePicture} from './picture.mjs';

const folder = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'picture');
const kept = {missedBefore: 3, missed: 3, perSecond: 199.5, nominalPerSecond: 200};
const page = (ticks) => ({screenshot: async () => Buffer.from('png'), evaluate: async (what) => (assert.equal(what, 'brachy.ticks'), ticks)});

test('a picture is stored where the simulation keeps its pace, and where there is none', async () => {
  rmSync(folder, {recursive: true, force: true});
  mkdirSync(folder, {recursive: true});
  await storePicture(page(kept), join(folder, 'good.png'));
  assert.equal(readFileSync(join(folder, 'good.png'), 'latin1'), 'png');
  assert.equal(refusal({missedBefore: 0, missed: 0, perSecond: 0, nominalPerSecond: 0}), '', 'a recording');
});

test('with a missed tick, or fewer than there should be, nothing is written and the script fails', async () => {
  for (const [ticks, why] of [[{...kept, missed: 4}, /1 ticks were missed/], [{...kept, missedBefore: 0, missed: 5630}, /5630 ticks/], [{...kept, perSecond: 129}, /129 of 200 ticks a second/]]) {
    await assert.rejects(storePicture(page(ticks), join(folder, 'bad.png')), why);
    assert.ok(!existsSync(join(folder, 'bad.png')));
  }
});

test('every picture that screenshots.sh takes of a page goes this way', () => {
  const source = (name) => readFileSync(new URL(name, import.meta.url), 'utf8');
  for (const name of ['screenshots.mjs', 'theatre_screenshot.mjs', 'ultrasound_screenshot.mjs']) {
    assert.match(source(name), /storePicture\(page, join\(pictures,/, name);
    assert.doesNotMatch(source(name), /\.screenshot\(/, name);
  }
});
