// Exercises one after the other in the browser, without a terminal: begin, be scored, begin again, the next one.
import assert from 'node:assert/strict';
import {existsSync, mkdirSync, readFileSync, readdirSync, rmSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage, waitFor} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'attempts');
const scene = fileURLToPath(new URL('../../config/exercises/scenes/01_one_needle.toml', import.meta.url));
const sessions = join(artefacts, 'class');

let browser, daemon, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  daemon = await Daemon.start(scene, join(artefacts, 'brachyd.log'), undefined, ['--sessions', sessions]);
  browser = await launch();
  page = await newPanelsPage(browser, {viewport: {width: 1366, height: 768}});
  page.on('pageerror', (error) => errors.push(error.message));
  await page.goto(`${daemon.url}?as=trainee`);
  await comesTrue(page, 'brachy.frames > 3 && brachy.exercise.offered.length > 0');
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

const manifest = (attempt) => JSON.parse(readFileSync(join(sessions, attempt, 'session.json')));
const attempts = () => readdirSync(sessions).sort();
/** An attempt is recorded, and the page shows the run of the daemon that it is. */
async function begun(attempt, name) {
  await waitFor(() => attempts().includes(attempt) && existsSync(join(sessions, attempt, 'session.json')), () => attempts().join());
  await comesTrue(page, `brachy.connection.phase === 'open' && brachy.exercise.offered.some((e) => e.running && e.name === ${JSON.stringify(name)}) && brachy.exercise.result === null`);
}

test('an attempt is scored, with what was missed and what went wrong, and its report opens', async () => {
  await page.locator('#exercise-check').click();
  await waitFor(async () => (await page.evaluate('brachy.exercise.result'))?.state === 'scored', async () => JSON.stringify(await page.evaluate('brachy.exercise.result')));
  assert.equal(await page.locator('#exercise-verdict').textContent(), 'Not passed so far');
  const [report] = await Promise.all([page.context().waitForEvent('page'), page.locator('#exercise-report').click()]);
  await report.waitForLoadState();
  assert.match(await report.locator('body').textContent(), /Exercise “one needle to a point”: not passed/);
  await report.close();
});

test('it is begun again under a name, and the next one after it', async () => {
  await page.locator('#exercise-list summary').click();
  await page.locator('#exercise-trainee').click();
  await page.keyboard.type('Anna');
  await page.locator('#exercise-again').click();
  await begun('0002_01_one_needle', 'one needle to a point');
  assert.equal(manifest('0002_01_one_needle').trainee, 'Anna');
  assert.ok(existsSync(join(sessions, '0001_01_one_needle/report.html')));
  assert.equal(await page.locator('#exercise-verdict').textContent(), '', 'another attempt has no result yet');
  await page.locator('#exercise-following').click();
  await begun('0003_02_one_train', 'one train');
  assert.equal(manifest('0003_02_one_train').trainee, 'Anna');
  await page.screenshot({path: join(artefacts, 'second.png')});
});

test('any is begun from the list', async () => {
  await page.getByRole('button', {name: 'Start: the apex'}).click();
  await begun('0004_05_apex', 'the apex');
  assert.deepEqual(attempts(), ['0001_01_one_needle', '0002_01_one_needle', '0003_02_one_train', '0004_05_apex']);
});

test('nothing went wrong in the page', () => assert.deepEqual(errors, []));
