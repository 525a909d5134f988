// The page says what is old, and offers only what is granted and done.
import assert from 'node:assert/strict';
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage, waitFor} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'honest');
const config = fileURLToPath(new URL('../../config/', import.meta.url));
const log = join(artefacts, 'brachyd.log');
const small = '[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n';

let browser, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  browser = await launch();
});
afterEach(async () => {
  await page?.close();
  await Daemon.stopAll();
});
after(async () => {
  await browser?.close();
});

function scene(name, text = '') {
  const file = join(artefacts, `${name}.toml`);
  writeFileSync(file, `name = "${name}"\n${small}${text}`);
  return file;
}

async function open(daemon, query = '', script = () => {}) {
  page = await newPanelsPage(browser, {viewport: {width: 1280, height: 640}});
  page.on('pageerror', (error) => errors.push(error.message));
  await page.addInitScript(script);
  await page.goto(`${daemon.url}${query}`);
  await comesTrue(page, 'brachy.frames > 3');
}

const text = (selector) => page.locator(selector).textContent();
const says = (selector, pattern) => waitFor(async () => pattern.test(await text(selector)), () => text(selector));

test('a daemon that stands still: verdict, read-outs, needle and connection are old, with their age, and fresh again after', async () => {
  const daemon = await Daemon.start(scene('still', `[device]\nkind = "scripted"\ntrajectory = "${config}insertion.csv"\nloop = true\n`), log, undefined, ['--play']);
  await open(daemon);
  await comesTrue(page, 'brachy.needle !== null');
  await says('#verdict', /follows|folding/);
  daemon.child.kill('SIGSTOP');
  // Two seconds: a picture that was late before came out of the socket meanwhile.
  await says('#late', /· (\d?[2-9]|\d\d)\.\d s old|min old/);
  assert.match(await page.locator('#verdict').getAttribute('class'), /\bold\b/);
  assert.doesNotMatch(await page.locator('#verdict').getAttribute('class'), /good/);
  await says('#connection', /no picture · .* old/);
  await says('#age-note', /^This picture is .* old\.$/);
  const colours = await page.evaluate(`[getComputedStyle(document.querySelector('#r-depth')).color, getComputedStyle(document.querySelector('#scene')).filter]`);
  assert.notEqual(colours[0], await page.evaluate('getComputedStyle(document.body).color'));
  assert.match(colours[1], /grayscale/);
  writeFileSync(join(artefacts, 'old.png'), await page.screenshot());
  daemon.child.kill('SIGCONT');
  await comesTrue(page, `document.querySelector('#age-note').hidden && !document.body.classList.contains('old')`);
  await says('#connection', /^live/);
});

test('a daemon that is killed leaves no green verdict behind', async () => {
  const daemon = await Daemon.start(scene('killed'), log);
  await open(daemon);
  daemon.child.kill('SIGKILL');
  await says('#late', /old/);
  assert.doesNotMatch(await page.locator('#verdict').getAttribute('class'), /good/);
  await daemon.ended;
});

test('a tab that is chosen while the page connects shows what it is for', async () => {
  const daemon = await Daemon.start(scene('tabs'), log);
  await open(daemon, '?as=research', () => {  // `press` is pressed once, behind the next HELLO, before its answer can have come
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (data) {
      send.call(this, data);
      const view = new DataView(data.buffer ?? data, data.byteOffset ?? 0, data.byteLength);
      const press = window.press;
      if (view.getUint16(6, true) !== 1 || !press) return;
      window.press = null;
      document.querySelector(press).click();
    };
  });
  for (const [first, second, isWanted] of [['ultrasound', 'needle', false], ['ultrasound', 'dose', false], ['ultrasound', null, true], ['needle', 'ultrasound', true]]) {
    await page.evaluate((press) => { window.press = press; }, second && `#tab-${second}`);
    await page.locator(`#tab-${first}`).click();
    await comesTrue(page, `!window.press && brachy.subscribesToUltrasound === ${isWanted} && brachy.connection.phase === 'open'`);
    if (isWanted) await comesTrue(page, 'brachy.images.length > 0');
  }
});

test('a file that is no recording leaves connection and needle as they are', async () => {
  await open(await Daemon.start(scene('wrong'), log));
  await page.locator('#take').click();
  await comesTrue(page, '/by hand/.test(brachy.device)');
  const choosing = page.waitForEvent('filechooser');
  await page.locator('#open').click();
  await (await choosing).setFiles({name: 'notes.txt', mimeType: 'text/plain', buffer: readFileSync(join(artefacts, 'wrong.toml'))});
  await page.locator('#toasts p', {hasText: /no brachy recording/}).waitFor();
  const frames = await page.evaluate('brachy.frames');
  await comesTrue(page, `brachy.frames > ${frames + 15}`);
  assert.match(await page.evaluate('brachy.device'), /by hand/);
  assert.deepEqual(await page.evaluate('[brachy.connection.phase, brachy.connection.reconnects]'), ['open', 0]);
});

test('reset is offered where it is done: not while a session is recorded, nor to who looks on', async () => {
  await open(await Daemon.start(scene('free'), log));
  await comesTrue(page, `!document.querySelector('#reset').disabled`);
  await page.locator('#scene').press('r');
  await page.locator('#confirm[open]').waitFor();
  await page.close();
  const recorded = await Daemon.start(scene('recorded'), log, undefined, ['--session', join(artefacts, 'session')]);
  await open(recorded);
  await says('#model-note', /A session is being recorded: no reset, no other model/);
  for (const id of ['reset', 'kernel', 'support']) assert.equal(await page.locator(`#${id}`).isDisabled(), true, id);
  await page.locator('#scene').press('r');
  assert.equal(await page.locator('#confirm[open]').count(), 0);
  await page.close();
  await open(recorded, '?role=viewer');
  assert.equal(await page.locator('#reset').isDisabled(), true);
});

test('with catheters the dose panel says that no seed is to come', async () => {
  await open(await Daemon.start(join(config, 'hdr.toml'), log));
  await page.locator('#scene').press('d');
  await says('#dose-none', /^High dose rate: nothing stays in the tissue\. 0 of 18 catheters are in\./);
});

test('events are in words, and in the terms of the daemon behind a switch', async () => {
  const daemon = await Daemon.start(scene('words', `[device]\nkind = "scripted"\ntrajectory = "${config}insertion.csv"\nloop = true\n`), log);
  await open(daemon);
  await page.locator('#reset').click();  // the needle had perhaps gone through before the page came, and goes in again by its old path
  await page.locator('#confirm button[value="yes"]').click();
  await says('#events', /The needle went through the capsule\./);
  const item = page.locator('#events li', {hasText: 'The needle went through the capsule.'}).first();
  assert.equal(await item.getAttribute('title'), 'capsule punctured');
  await page.locator('#terms').click();
  await says('#events', /capsule punctured/);
  await says('#verdict', /injective|FIELD FOLDS|folding unknown/);
});

test('nothing went wrong in the pages', () => assert.deepEqual(errors, []));
