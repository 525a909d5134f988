// The plan in the browser: an operator adds a needle, moves its seeds, and has the rest optimised; the daemon answers with plan and dose.
import assert from 'node:assert/strict';
import {mkdirSync, rmSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newQuickPage} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'plan');
const config = fileURLToPath(new URL('../../config/', import.meta.url));

let browser, daemon, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  const scene = join(artefacts, 'scene.toml');
  writeFileSync(scene, `name = "plan"\n[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n[plan]\nfile = "${join(config, 'plan.toml')}"\n`);
  daemon = await Daemon.start(scene, join(artefacts, 'brachyd.log'));
  browser = await launch();
  page = await newQuickPage(browser, {viewport: {width: 1200, height: 860}});
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  await page.goto(daemon.url);
  await comesTrue(page, 'brachy.frames > 3 && brachy.plan !== null');
  await comesTrue(page, `!document.querySelector('#tab-plan').hidden`);
  await page.keyboard.press('l');
  await comesTrue(page, `document.querySelectorAll('#plan-grid button').length > 0`);
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

const plan = () => page.evaluate('brachy.plan');
const needle = async (hole) => (await plan()).needles.find((each) => each.hole === hole);
const changed = (to) => comesTrue(page, `brachy.plan.change === ${to}`);
const hole = (name) => page.locator(`#plan-grid button[data-hole="${name}"]`);

test('the template shows the needles of the plan, and a click on a free hole adds one by the loading rule', async () => {
  const first = await plan();
  assert.equal(await page.locator('#plan-grid button').count(), 13 * 13);
  assert.equal(await page.locator('#plan-grid button.planned').count(), first.needles.length);
  assert.match(await page.locator('#plan-by').textContent(), /plan\.toml/);
  assert.equal(await needle('G7'), undefined);
  const seeds = await page.evaluate('brachy.plannedSeeds');
  await hole('G7').click();
  await changed(1);
  assert.match((await needle('G7')).train, /^s(-s)+$/);
  assert.ok(await page.evaluate('brachy.plannedSeeds') > seeds);
  await comesTrue(page, 'brachy.dose !== null && brachy.dose.withPlanned.length > 0');
  await comesTrue(page, `document.querySelector('#plan-figures').textContent.includes('V100')`);
  assert.equal(await page.locator('#plan-hole').textContent(), 'G7');
  await page.screenshot({path: join(artefacts, 'needle_added.png')});
});

test('a seed is dragged and moved by the arrow keys, and the depth is set', async () => {
  const before = (await needle('G7')).train;
  const last = page.locator('#plan-train button').last();
  const box = await last.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 36, box.y + box.height / 2, {steps: 4});
  await page.mouse.up();
  await changed(2);
  assert.equal((await needle('G7')).train, `${before.slice(0, -1)}--s`);
  await comesTrue(page, `document.querySelectorAll('#plan-train > *').length === ${before.length + 2}`);
  await page.locator('#plan-train button').last().focus();
  await page.keyboard.press('ArrowLeft');
  await changed(3);
  assert.equal((await needle('G7')).train, `${before.slice(0, -1)}-s`);
  await page.locator('#plan-depth').fill('75');
  await page.locator('#plan-depth').press('Enter');
  await changed(4);
  assert.equal((await needle('G7')).depthMm, 75);
});

test('holes are reached by the arrow keys, and Delete removes the needle of the chosen one', async () => {
  await hole('G7').focus();
  await page.keyboard.press('ArrowRight');  // seen from the feet: towards column A
  assert.equal(await page.evaluate('document.activeElement.dataset.hole'), 'F7');
  await page.keyboard.press('ArrowLeft');
  await page.keyboard.press('Delete');
  await changed(5);
  assert.equal(await needle('G7'), undefined);
  await comesTrue(page, `document.querySelector('#plan-needle').hidden`);
});

test('the rest is optimised on request, and what is refused is said', async () => {
  await page.locator('#plan-optimise').click();
  await comesTrue(page, `document.querySelector('#plan-note').textContent.includes('being optimised') || brachy.plan.change === 6`);
  await changed(6);
  assert.equal((await plan()).kind, 2);
  const gland = await page.evaluate(`brachy.dose.withPlanned.find((each) => each.name === 'prostate').v100Percent`);
  assert.ok(gland > 90, `V100 ${gland} %`);
  await page.screenshot({path: join(artefacts, 'optimised.png')});
  await hole('A1').click();  // its needle passes beside the gland
  await comesTrue(page, `document.querySelector('#toasts').textContent.includes('does not pass through the gland')`);
  assert.equal((await plan()).change, 6);
});

test('nothing went wrong in the page', () => assert.deepEqual(errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text)), []));
