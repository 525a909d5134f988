// An exercise in the browser: what is asked, what passes, and the result of the session, which is that of `brachy score`.
import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {mkdirSync, rmSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage, waitFor} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'exercise');
const exercises = fileURLToPath(new URL('../../config/exercises/', import.meta.url));
const brachy = process.env.BRACHY ?? 'build/release/bin/brachy';
const scene = join(exercises, 'scenes/01_one_needle.toml');
const session = join(artefacts, 'session');

let browser, daemon, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  const trajectory = join(artefacts, 'by_plan.csv');
  execFileSync(brachy, ['plan', '--force', '--config', scene, '--trajectory', trajectory]);
  daemon = await Daemon.start(scene, join(artefacts, 'brachyd.log'), undefined, ['--session', session, '--trajectory', trajectory]);
  browser = await launch();
  page = await newPanelsPage(browser, {viewport: {width: 1100, height: 600}});
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  await page.goto(daemon.url);
  await comesTrue(page, 'brachy.frames > 3 && brachy.exercise.offered.length > 0');
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

const texts = (selector) => page.locator(selector).evaluateAll((all) => all.map((element) => element.textContent));

async function result() {
  await page.locator('#exercise-check').click();
  await comesTrue(page, 'brachy.exercise.result !== null && brachy.exercise.result.state !== "scoring"');
  return page.evaluate('brachy.exercise.result');
}

test('the exercise of the scene says what it asks and what passes; the others are listed', async () => {
  await page.locator('#tab-exercise').click();
  assert.equal(await page.locator('#exercise-name').textContent(), 'one needle to a point');
  assert.match(await page.locator('#exercise-asks').textContent(), /Go through I8 once/);
  assert.deepEqual(await texts('#exercise-lines li'), [
    'seeds placed at least 1', 'seeds extra at most 0', 'mean error at most 3 mm', 'passes through organs at most 0', 'insertions at most 1']);
  const names = await texts('#exercise-all dt');
  assert.equal(names.length, 14);
  assert.equal(names[0], 'one needle to a point (running)');
});

test('before the needle has gone in the exercise is not passed, and after it has, it is: as brachy score says', async () => {
  const early = await result();
  assert.notEqual(early.passed, true, JSON.stringify(early));
  await page.locator('#loop').click();  // once only
  await page.locator('#play').click();
  await comesTrue(page, 'brachy.seeds.length === 1 && brachy.needle !== null && brachy.needle[11] < -60');
  let shown;
  await waitFor(async () => (shown = await result()).passed === true, () => JSON.stringify(shown));  // an earlier result expires
  assert.equal(shown.state, 'scored', JSON.stringify(shown));
  assert.equal(shown.passed, true, JSON.stringify(shown));
  assert.equal(await page.locator('#exercise-verdict').textContent(), 'Passed so far');
  assert.deepEqual(await texts('#exercise-lines li.met'), shown.lines.map((line) => line.text));
  await page.locator('#right').screenshot({path: join(artefacts, 'passed.png')});

  await daemon.stop();
  const score = spawnSync(brachy, ['score', session, '--exercise', join(exercises, '01_one_needle.toml')], {encoding: 'utf8'});
  assert.equal(score.status, 0, score.stderr);
  for (const {text, kept} of shown.lines) assert.ok(score.stdout.includes(`${kept ? 'ok  ' : 'MISS'} ${text}\n`), `${text} in:\n${score.stdout}`);
});

test('nothing went wrong in the page', () => assert.deepEqual(errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text)), []));
