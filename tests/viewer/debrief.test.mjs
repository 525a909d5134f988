// The teacher's side: a class's sessions in the browser. A scripted teacher finds the mistake of each recorded session within three
// clicks: two sessions here, ten where BRACHY_SESSIONS is "all" (scripts/campaigns/browser.sh).
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, readdirSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {comesTrue, launch, newPanelsPage, waitFor} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import {SIZES, misplaced} from './misplaced.mjs';
import {MISTAKES, playSession, writeExercise, xyOf} from './played_sessions.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'debrief');
const brachy = process.env.BRACHY ?? 'build/release/bin/brachy';
const sessions = join(artefacts, 'class');
const names = Object.keys(MISTAKES).slice(0, process.env.BRACHY_SESSIONS === 'all' ? undefined : 2);
const axe = readFileSync(createRequire(new URL('../../apps/viewer/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');

let browser, daemon, page;
const planted = {};
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  for (const name of ['as_planned', ...names]) planted[name] = await playSession(artefacts, sessions, name, `trainee ${name}${name === 'urethra' ? ', whose name is as long as some names are' : ''}`);
  daemon = await Daemon.start(writeExercise(artefacts).scene, join(artefacts, 'brachyd.log'), undefined, ['--sessions', sessions]);
  browser = await launch();
  const context = await browser.newContext({bypassCSP: true, acceptDownloads: true, viewport: {width: 1366, height: 768}});  // for axe
  page = await newPanelsPage(context, {});
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  await page.goto(`${daemon.url}?as=teacher`);
  await comesTrue(page, `brachy.frames > 3 && brachy.debrief.sessions.length === ${names.length + 2}`);
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

const button = (name) => page.locator('#debrief-sessions button', {hasText: `trainee ${name},`});
const position = async () => (await page.evaluate('brachy.recording')).positionS;

/** Opens a session of the list by a click, and waits until it plays. */
async function open(name) {
  const {opened} = await page.evaluate('brachy.recording');
  await button(name).click();
  await comesTrue(page, `brachy.recording.opened > ${opened}`);
  await page.locator('#debrief-name', {hasText: `trainee ${name},`}).waitFor();
}

for (const name of names)
  test(`the teacher finds the mistake of "${name}" within three clicks`, async () => {
    await open(name);  // the first click
    const finding = page.locator('#debrief-findings button', {hasText: MISTAKES[name].says}).first();
    await finding.click();  // the second
    const {s, hole} = planted[name];
    assert.equal((await page.evaluate('brachy.recording')).playing, false);
    const shownS = await page.evaluate('brachy.debrief.sessionS');
    assert.ok(Math.abs(shownS - s) < MISTAKES[name].within, `shown is ${shownS} s; the mistake was made at ${s} s`);
    const needle = await page.evaluate('brachy.needle');
    assert.deepEqual([needle[3], needle[7]].map((value) => Math.round(value)), xyOf(hole), 'the needle is where the mistake was made');
    await page.screenshot({path: join(artefacts, `${name}.png`)});
  });

test('a session as planned has no finding, and says so', async () => {
  await open('as_planned');
  assert.equal(await page.locator('#debrief-findings li').count(), 0);
  assert.equal(await page.locator('#debrief-none').textContent(), 'The score found nothing wrong.');
});

test('the time line marks punctures, seeds, organs and findings; a click on it jumps, and so do the buttons beside it', async () => {
  await open('urethra');
  const marks = await page.evaluate('brachy.marks');
  const kinds = (kind) => marks.filter((mark) => mark.kind === kind);
  assert.deepEqual([kinds('drop').length, kinds('puncture').length >= 3, kinds('organ').length >= 1, kinds('finding').length >= 1], [4, true, true, true], JSON.stringify(marks));
  assert.match(await page.locator('#pb-marks').getAttribute('aria-label'), /finding.*organ.*4 seeds.*punctures/);
  const [{durationS}, box] = [await page.evaluate('brachy.recording'), await page.locator('#pb-marks').boundingBox()];
  const drop = kinds('drop').at(-1);
  await page.mouse.click(box.x + 8 + (drop.timeS / durationS) * (box.width - 16) + 2, box.y + box.height - 8);
  assert.equal(await position(), drop.timeS);
  await page.locator('#pb-back').click();
  const before = marks.findLast(({timeS}) => timeS < drop.timeS - 0.02);
  assert.equal(await position(), before.timeS);
  await page.locator('#pb-next').click();
  assert.ok(await position() > before.timeS);
  await page.locator('#pb-seek').focus();
  await page.keyboard.press('Home');
  assert.equal(await position(), 0, 'the slider scrubs by keys');
});

test('slow motion is as slow as it says', async () => {
  await open('urethra');
  await page.locator('#pb-speed').selectOption({label: '¼×'});
  const measure = () => page.evaluate(() => new Promise((done) => {
    let from;
    const step = (nowMs) => {
      from ??= {nowMs, positionS: brachy.recording.positionS};
      if (nowMs - from.nowMs < 800) return requestAnimationFrame(step);
      done((1000 * (brachy.recording.positionS - from.positionS)) / (nowMs - from.nowMs));
    };
    requestAnimationFrame(step);
  }));
  const rate = await measure();
  await page.locator('#pb-speed').selectOption({label: '1×'});
  assert.ok(rate > 0.15 && rate < 0.35, `${rate} of real time`);
});

test('a second attempt is shown beside it, on the same clock', async () => {
  await open('deep');
  await page.locator('#debrief-beside').selectOption({index: await page.locator('#debrief-beside option').evaluateAll((all) => all.findIndex(({text}) => /trainee as_planned/.test(text)))});
  await page.locator('#debrief-findings button').first().click();
  await comesTrue(page, 'brachy.debrief.besideS === brachy.recording.positionS');
  assert.equal(await page.locator('#beside-name').textContent(), 'trainee as_planned, two needles');
  const [one, two] = await Promise.all(['#scene', '#scene-beside'].map((id) => page.locator(id).boundingBox()));
  assert.ok(one.x + one.width <= two.x + 3 && Math.abs(one.width - two.width) < 4, 'side by side');
  await page.screenshot({path: join(artefacts, 'beside.png')});
  await page.locator('#debrief-beside').selectOption('');
  assert.equal(await page.locator('#scene-beside').isVisible(), false);
});

test('the link to a moment opens it again', async () => {
  await open('urethra');
  await page.locator('#debrief-findings button').first().click();
  const there = await position();
  await page.locator('#debrief-link').click();
  await waitFor(async () => /#t=/.test(page.url()), () => page.url());
  const link = page.url();
  assert.match(link, /as=teacher&session=0003_urethra#t=\d/);
  const other = await newPanelsPage(page.context(), {});
  await other.goto(link);
  await comesTrue(other, `brachy.recording.state === "ready" && !brachy.recording.playing && Math.abs(brachy.recording.positionS - ${there}) < 0.01`);
  await other.close();
});

test('a folder of files is opened by hand, with its report', async () => {
  const folder = join(sessions, readdirSync(sessions).sort()[2]);
  await page.locator('#live').click();
  await comesTrue(page, 'brachy.connection.phase === "open" && brachy.recording.state === "none"');
  await page.locator('#folder').setInputFiles(folder);
  await comesTrue(page, 'brachy.recording.state === "ready" && brachy.debrief.findings.length > 0');
  await page.screenshot({path: join(artefacts, 'folder.png')});
  assert.match(await page.locator('#debrief-findings').textContent(), MISTAKES[names[1]].says);
  await page.locator('#file').setInputFiles(join(folder, 'session.json'));
  await comesTrue(page, '/no brachy recording/.test(brachy.recording.state)');
  assert.ok((await page.evaluate('brachy.debrief')).findings.length > 0, 'what was open stays');
});

test('the running session is frozen and rewound, and goes on meanwhile', async () => {
  await page.locator('#live').click();
  await comesTrue(page, 'brachy.connection.phase === "open" && brachy.kept.seconds > 1.5');
  await page.screenshot({path: join(artefacts, 'live.png')});
  const {bytes} = await page.evaluate('brachy.kept');
  assert.ok(bytes > 0 && bytes <= 100e6);
  await page.locator('#debrief-freeze').click();
  await comesTrue(page, 'brachy.recording.state === "ready" && !brachy.recording.playing');
  const {positionS, durationS} = await page.evaluate('brachy.recording');
  assert.equal(positionS, durationS, 'frozen at the last moment');
  assert.ok(durationS > 1.4);
  const tick = await page.evaluate('brachy.tick');
  await page.locator('#pb-seek').focus();
  await page.keyboard.press('Home');
  assert.ok(await page.evaluate('brachy.tick') < tick, 'rewound');
  const kept = (await page.evaluate('brachy.kept')).seconds;
  await comesTrue(page, `brachy.kept.seconds > ${kept} + 0.5`);
  assert.equal((await page.evaluate('brachy.connection')).phase, 'open');
  assert.equal(await page.evaluate('brachy.recording.positionS'), 0, 'what comes meanwhile is not shown');
  await page.locator('#live').click();
  await comesTrue(page, `brachy.tick > ${tick} && brachy.recording.state === "none"`);
});

test('the class is a page and a table, those of brachy score', async () => {
  const [opened] = await Promise.all([page.context().waitForEvent('page'), page.locator('#class-page').click()]);
  await opened.waitForLoadState();
  const text = await opened.locator('body').textContent();
  for (const part of ['Class', 'trainee deep', 'trainee urethra', 'the urethra was entered 1 time', 'passed 20']) assert.ok(text.includes(part), part);
  await opened.screenshot({path: join(artefacts, 'class.png')});
  await opened.close();
  const [file] = await Promise.all([page.waitForEvent('download'), page.locator('#class-csv').click()]);
  assert.equal(file.suggestedFilename(), 'class.csv');
  const csv = join(artefacts, 'class.csv');
  execFileSync(brachy, ['score', '--class', sessions, '--csv', csv]);
  assert.equal(readFileSync(await file.path(), 'utf8'), readFileSync(csv, 'utf8'));
});

test('axe finds nothing in the debrief', async () => {
  await open('urethra');
  await page.locator('#debrief-findings button').first().click();
  await page.evaluate(axe);
  const {violations} = await page.evaluate('axe.run()');
  assert.deepEqual(violations.map(({id, nodes}) => `${id}: ${nodes.map(({target, any}) => `${target} ${any[0]?.message ?? ''}`).join('; ')}`), []);
});

test('the debrief of a session, and one beside it: nothing is cut off or covered at any size', async () => {
  const found = [];
  for (const [width, height] of SIZES) {
    await page.setViewportSize({width, height});
    await page.goto(`${daemon.url}?as=teacher&session=0003_urethra#t=3`);
    await comesTrue(page, 'brachy.recording.state === "ready" && brachy.debrief.findings.length > 0');
    const note = async (where) => found.push(...(await misplaced(page)).map((text) => `${width} × ${height}, ${where}: ${text}`));
    const settled = () => page.locator('#right').evaluate((drawer) => Promise.all(drawer.getAnimations().map((each) => each.finished)));
    await note('time line');
    if (await page.locator('#toggle-right').isVisible()) await page.locator('#toggle-right').click();
    await settled();
    await page.locator('#debrief-beside').selectOption({index: 1});
    await comesTrue(page, 'brachy.debrief.besideS >= 0');
    await note('panel');
    await page.screenshot({path: join(artefacts, `debrief-${width}-panel.png`)});
    await page.locator('#debrief-findings button').first().click();  // closes a drawer
    await settled();
    await note('at a finding');
    await page.screenshot({path: join(artefacts, `debrief-${width}.png`)});
  }
  assert.deepEqual(found, []);
});

test('nothing went wrong in the page', () => assert.deepEqual(errors, []));
