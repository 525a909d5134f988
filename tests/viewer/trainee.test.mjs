// The needle by hand, as a trainee uses it: by real keys, mouse and touches, on exercises with trains and with a magazine.
import assert from 'node:assert/strict';
import {mkdirSync, rmSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage, waitFor} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import {viewer} from './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'trainee');
const config = fileURLToPath(new URL('../../config/', import.meta.url));
const log = join(artefacts, 'brachyd.log');
const FASTEST_MM_S = 120;

let browser;
const errors = [];
const pages = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  browser = await launch();
});
afterEach(async () => {
  for (const page of pages.splice(0)) await page.close();
  await Daemon.stopAll();
});
after(async () => {
  await browser?.close();
});

const small = '[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n';
/** The scene of an exercise on a small phantom, so that what draws in software beside it keeps up. */
function scene(name, text, kernel = 'psi31') {
  const file = join(artefacts, `${name}.toml`);
  writeFileSync(file, `name = "${name}"\n${small}[model]\nkernel = "${kernel}"\n${text}`);
  return file;
}
const train = (plan) => scene(plan, `[plan]\nfile = "${config}exercises/plans/${plan}.toml"\n[seeds]\napplicator = "train"\n`);

async function open(daemon, query = '', more = {}, first = () => {}) {
  const page = await newPanelsPage(browser, {viewport: {width: 1100, height: 560}, ...more});
  pages.push(page);
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => message.type() === 'error' && !/WebSocket|ERR_CONNECTION/.test(message.text()) && errors.push(message.text()));
  // The poses of the needle that leave this page.
  await page.addInitScript(() => {
    window.poses = [];
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (data) {
      const view = new DataView(data.buffer ?? data, data.byteOffset ?? 0, data.byteLength);
      if (view.getUint16(6, true) === 5) window.poses.push({atMs: performance.now(), tip: [3, 7, 11].map((i) => view.getFloat64(32 + 8 + 8 * i, true))});
      return send.call(this, data);
    };
  });
  await page.addInitScript(first);
  await page.goto(`${daemon.url}${query}`);
  await comesTrue(page, 'brachy.frames > 3');
  return page;
}

/** The fastest that the page has moved a needle, mm/s, over any 0.1 s of what it sent. */
const fastest = (page) => page.evaluate(() => {
  let most = 0;
  for (let i = 0, j = 0; j < window.poses.length; ++j) {
    while (window.poses[j].atMs - window.poses[i].atMs > 100) ++i;
    const [a, b] = [window.poses[i], window.poses[j]];
    if (b.atMs - a.atMs > 60) most = Math.max(most, Math.hypot(...b.tip.map((value, axis) => value - a.tip[axis])) / (b.atMs - a.atMs) * 1000);
  }
  return most;
});

/** Chooses a hole in the list with the keyboard, as typed: the list finds it by its first letters, where they come within a second, which
 * beside a busy machine they may not. */
async function typeHole(page, hole) {
  const list = page.locator('#hole');
  await waitFor(async () => {
    await list.focus();
    await page.keyboard.press('Home');
    await page.keyboard.type(hole, {delay: 5});
    return (await list.inputValue()) === hole;
  }, () => list.inputValue());
  await page.keyboard.press('Tab');
}

/** Turns the wheel over the scene until the tip is this deep beyond the template, mm. */
async function wheelTo(page, mm) {
  const box = await page.locator('#scene').boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  for (let turns = 0; turns < 400; ++turns) {
    const left = mm - (await page.evaluate('brachy.handDepthMm'));
    if (Math.abs(left) < 0.05) break;
    await page.mouse.wheel(0, -Math.sign(left) * Math.min(150, 50 * Math.abs(left)));
  }
  await comesTrue(page, `Math.abs(brachy.depthBeyondTemplateMm - ${mm}) < 0.3`);
}

const note = (page) => page.locator('#hand-note').textContent();

test('a train falls seed by seed, each where the plan has it, by clicks on the button alone', async () => {
  const page = await open(await Daemon.start(train('02_one_train'), log));
  const plan = await page.evaluate('brachy.plan');
  const {hole, depthMm} = plan.needles[0];
  await typeHole(page, hole);
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  await wheelTo(page, depthMm);
  const planned = await page.evaluate('brachy.plannedPositions');
  for (let seeds = 1; seeds <= 4; ++seeds) {
    await page.locator('#drop').click();
    await comesTrue(page, `brachy.seeds.length === ${seeds}`);
    await waitFor(async () => (await note(page)).startsWith(`Seed ${seeds} dropped`), () => note(page));
  }
  assert.match(await note(page), /the needle is empty/);
  const seeds = await page.evaluate('brachy.seeds');
  for (const seed of seeds) {
    const way = Math.hypot(...seed.rest.map((value, axis) => value - planned[seed.planned].position[axis]));
    assert.ok(way < 2.5, `seed ${seed.id} lies ${way.toFixed(2)} mm from its place in the plan`);
  }
  assert.ok(await fastest(page) < 1.05 * FASTEST_MM_S);
  await page.locator('#drop').click();
  await waitFor(async () => /No seed dropped: the needle is empty/.test(await note(page)), () => note(page));
});

// As on a busy machine, or over a slow network: the next press came while the one before had already dropped two.
test('a press drops one seed of a train also where the picture is late', async () => {
  const page = await open(await Daemon.start(train('02_one_train'), log), '', {}, () => {
    const {set} = Object.getOwnPropertyDescriptor(WebSocket.prototype, 'onmessage');
    Object.defineProperty(WebSocket.prototype, 'onmessage', {set(heard) { set.call(this, heard && ((event) => setTimeout(() => heard(event), 1000))); }});
  });
  const {hole, depthMm} = (await page.evaluate('brachy.plan')).needles[0];
  await typeHole(page, hole);
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  await wheelTo(page, depthMm);
  for (let seeds = 1; seeds <= 4; ++seeds) {
    await page.locator('#drop').click();
    await comesTrue(page, `brachy.seeds.length >= ${seeds}`);
    await waitFor(async () => (await note(page)).startsWith(`Seed ${seeds} dropped`), () => note(page));
    assert.equal(await page.evaluate('brachy.seeds.length'), seeds);
    const beyondMm = await page.evaluate('brachy.seeds.at(-1).dropped[2] - poses.at(-1).tip[2]');
    assert.ok(beyondMm < 3.5, `the needle was drawn ${beyondMm.toFixed(1)} mm beyond the seed`);
  }
});

test('a train falls also where the needle is not where the hand has it', async () => {
  const noise = '[noise]\non = true\nseed = 31\ndrift_mm = 1.8\n';  // 3.9 mm too shallow
  const file = scene('noise', `[plan]\nfile = "${config}exercises/plans/02_one_train.toml"\n[seeds]\napplicator = "train"\n${noise}`);
  const page = await open(await Daemon.start(file, log));
  const {hole, depthMm} = (await page.evaluate('brachy.plan')).needles[0];
  await typeHole(page, hole);
  await page.locator('#take').click();
  await comesTrue(page, 'Math.abs(brachy.depthBeyondTemplateMm - brachy.handDepthMm) > 2');
  await page.locator('#help-button').focus();
  while ((await page.evaluate('brachy.handDepthMm')) < depthMm) await page.keyboard.press('PageUp');
  await comesTrue(page, `brachy.depthBeyondTemplateMm > ${depthMm} - 8`);
  for (let seeds = 1; seeds <= 2; ++seeds) {
    await page.locator('#drop').click();
    await waitFor(async () => (await note(page)).startsWith(`Seed ${seeds} dropped`), () => note(page));
  }
});

test('a seed of a magazine falls at the tip, and the needle stays', async () => {
  const page = await open(await Daemon.start(scene('single', ''), log));
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  await wheelTo(page, (await page.evaluate('brachy.glandDepths'))[0] + 20);
  const before = await page.evaluate('brachy.handDepthMm');
  await page.locator('#scene').press('s');
  await comesTrue(page, 'brachy.seeds.length === 1');
  await waitFor(async () => /^Seed 1 dropped, .* mm beyond the template\.$/.test(await note(page)), () => note(page));
  assert.equal(await page.evaluate('brachy.handDepthMm'), before);
});

test('why no seed falls is said', async () => {
  const page = await open(await Daemon.start(scene('outside', ''), log));
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  await wheelTo(page, -15);
  await page.keyboard.press('s');
  await waitFor(async () => /the tip was outside the body, and the seed is lost/i.test(await note(page)), () => note(page));
});

test('a drop that is held by S goes on while other keys go up and down', async () => {
  const page = await open(await Daemon.start(train('02_one_train'), log));
  const {hole, depthMm} = (await page.evaluate('brachy.plan')).needles[0];
  await typeHole(page, hole);
  await page.locator('#scene').focus();
  await page.keyboard.press('n');
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  await wheelTo(page, depthMm);
  await page.locator('#scene').focus();
  await page.keyboard.down('s');
  await page.keyboard.press('Shift');
  await page.keyboard.press('w');  // wireframe
  await page.keyboard.press('w');
  await comesTrue(page, 'brachy.seeds.length === 4');
  await page.keyboard.up('s');
});

test('another hole: the needle is drawn out first, then goes across, and never faster than a hand', async () => {
  const page = await open(await Daemon.start(scene('holes', ''), log));
  await typeHole(page, 'G7');
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  const [least] = await page.evaluate('brachy.glandDepths');
  await wheelTo(page, least + 15);
  await page.evaluate('window.poses.length = 0');
  await typeHole(page, 'E6');
  const {origin, spacingMm} = await page.evaluate('brachy.template');
  const [x, y] = [origin[0] + 4 * spacingMm, origin[1] + 5 * spacingMm];
  await comesTrue(page, `Math.abs(brachy.needle[3] - ${x}) < 0.01 && Math.abs(brachy.needle[7] - ${y}) < 0.01`);
  const poses = await page.evaluate('window.poses');
  const inside = poses.filter(({tip}) => tip[2] - origin[2] > least - 1);
  assert.ok(inside.length > 5, 'it came out by itself');
  for (const {tip} of inside) assert.deepEqual(tip.slice(0, 2), poses[0].tip.slice(0, 2), 'no way across the tissue');
  assert.ok(await fastest(page) < 1.05 * FASTEST_MM_S, `${await fastest(page)} mm/s`);
});

test('a needle that is let go of in the gland is taken again where it is', async () => {
  const page = await open(await Daemon.start(scene('again', ''), log));
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  const depth = (await page.evaluate('brachy.glandDepths'))[0] + 12;
  await wheelTo(page, depth);
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.device === ""');
  const there = (await page.evaluate('brachy.needle'))[11];
  await page.evaluate('window.poses.length = 0');
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.device !== "" && window.poses.length > 10');
  for (const {tip} of await page.evaluate('window.poses')) assert.ok(Math.abs(tip[2] - there) < 1e-6, `${tip[2]} and ${there}`);
});

test('a page behind another keeps its needle', async () => {
  const daemon = await Daemon.start(scene('behind', ''), log);
  const page = await open(daemon);
  await page.locator('#take').click();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  await page.evaluate(() => {  // headless chromium hides no page by itself
    Object.defineProperty(document, 'visibilityState', {configurable: true, get: () => 'hidden'});
    document.dispatchEvent(new Event('visibilitychange'));
  });
  const frames = await page.evaluate('brachy.frames');
  await comesTrue(page, `brachy.frames > ${frames + 30}`);
  assert.match(await page.evaluate('brachy.device'), /by hand/);
});

test('touches advance, withdraw and drop on a tablet, with no drawer over the needle', async () => {
  const daemon = await Daemon.start(train('02_one_train'), log);
  const page = await open(daemon, '', {viewport: {width: 768, height: 1024}, hasTouch: true});
  const {hole, depthMm} = (await page.evaluate('brachy.plan')).needles[0];
  await typeHole(page, hole);
  await page.locator('#take').tap();
  await comesTrue(page, 'brachy.needle !== null && brachy.device !== ""');
  const touch = await page.context().newCDPSession(page);
  const box = await page.locator('#advance').boundingBox();
  const at = [{x: box.x + box.width / 2, y: box.y + box.height / 2}];
  await touch.send('Input.dispatchTouchEvent', {type: 'touchStart', touchPoints: at});
  await comesTrue(page, `brachy.handDepthMm >= ${depthMm - 2}`);
  await touch.send('Input.dispatchTouchEvent', {type: 'touchEnd', touchPoints: []});
  await page.locator('#withdraw').tap();
  await page.locator('#drop').tap();
  await comesTrue(page, 'brachy.seeds.length === 1');
  const [scene, bar] = [await page.locator('#scene').boundingBox(), await page.locator('#hand-bar').boundingBox()];
  assert.ok(bar.y >= scene.y + scene.height - 1, 'the bar does not lie over the scene');
  await page.screenshot({path: join(artefacts, 'tablet.png')});
});

test('who looks on is offered no needle, by button or key', async () => {
  const daemon = await Daemon.start(scene('onlooker', ''), log);
  const page = await open(daemon, '?role=viewer');
  assert.equal(await page.locator('#take').isVisible(), false);
  await page.keyboard.press('n');
  const frames = await page.evaluate('brachy.frames');
  await comesTrue(page, `brachy.frames > ${frames + 15}`);
  assert.equal(await page.evaluate('brachy.device'), '');
});

test('the second operator is not given the ultrasound probe', async () => {
  const daemon = await Daemon.start(scene('theatre', '[probe]\non = true\n', 'elastic'), log);
  const first = await open(daemon);
  await first.locator('#take').click();
  await comesTrue(first, '/by hand/.test(brachy.device)');
  const second = await open(daemon);
  await second.locator('#take').click();
  await second.locator('#toasts p', {hasText: /not granted/}).waitFor();
  assert.equal((await second.evaluate('brachy.device')).match(/by hand/g).length, 1);
  assert.equal(await second.locator('#take').textContent(), 'Take the needle');
});

test('of several needles the second operator gets a free one', async () => {
  const daemon = await Daemon.start(scene('two', '[needle]\ncount = 2\n'), log);
  const [first, second] = [await open(daemon), await open(daemon)];
  for (const page of [first, second]) {
    await page.locator('#take').click();
    await comesTrue(page, 'brachy.heldNeedle >= 0');
  }
  assert.deepEqual(await Promise.all([first, second].map((page) => page.evaluate('brachy.heldNeedle'))), [0, 1]);
});

test('the next step is said in one sentence, up to the last seed', () => {
  const grid = {origin: [0, 0, -100], spacingMm: 5, columns: 3, rows: 3};
  const session = new viewer.Session();
  session.scene = {template: grid, plannedNeedles: [{hole: 'B2', tip: [5, 5, -20]}], plannedSeeds: [0, 1].map((i) => ({position: [5, 5, -22 - 10 * i], axis: [0, 0, 1], needle: 0}))};
  const say = (more) => viewer.nextStep(session, {held: true, needle: 0, hole: 'B2', tip: [5, 5, -60], ...more});
  assert.equal(say({held: false}), 'Take the needle.');
  assert.equal(say({hole: ''}), 'Choose a hole: the plan begins with B2.');
  assert.equal(say({}), 'Advance in B2 to 80.0 mm beyond the template.');
  assert.equal(say({tip: [5, 5, -10]}), 'Draw back in B2 to 80.0 mm beyond the template.');
  assert.equal(say({tip: [5, 5, -20.4]}), 'Press “Drop seed”: 2 seeds for B2.');
  session.assembler.seeds = [{planned: 0}];
  assert.equal(say({tip: [5, 5, -26]}), 'Go on with “Drop seed”: one seed to go in B2.');
  session.assembler.seeds = [{planned: 0}, {planned: 1}];
  assert.match(say({}), /draw the needle out, then ask for your result/);
});

test('nothing went wrong in the pages', () => assert.deepEqual(errors, []));
