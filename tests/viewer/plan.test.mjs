// The plan in the browser: an operator adds a needle, moves its seeds, and has the rest optimised; the daemon answers with plan and dose.
import assert from 'node:assert/strict';
import {mkdirSync, rmSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage} from './browser.mjs';
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
  page = await newPanelsPage(browser, {viewport: {width: 1200, height: 860}});
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
  await typeDepth('75');
  await changed(4);
  assert.equal((await needle('G7')).depthMm, 75);
});

/** Types a depth as a hand does: the keys 0 to 3, "." and "-" are shortcuts elsewhere. */
async function typeDepth(text) {
  await page.locator('#plan-depth').click({clickCount: 3});
  await page.keyboard.type(text);
  assert.equal(await page.locator('#plan-depth').inputValue(), text);
  await page.keyboard.press('Enter');
}

test('every key of a number reaches the depth field, and none of them acts elsewhere', async () => {
  const view = await page.evaluate('brachy.onScreen([0, 0, 0])');
  const scanner = await page.evaluate('JSON.stringify(brachy.scanner)');
  await typeDepth('68.5');
  await changed(5);
  assert.equal((await needle('G7')).depthMm, 68.5);
  await typeDepth('70,25');
  await changed(6);
  assert.equal((await needle('G7')).depthMm, 70.25);
  await page.locator('#plan-depth').click({clickCount: 3});
  await page.keyboard.type('0123456789.-,+=[]wigtpxadluefbhmvskronc?');
  await page.keyboard.press('Escape');
  assert.equal(await page.locator('#plan-depth').inputValue(), '70.3');
  assert.equal(await page.locator('#tab-plan').getAttribute('aria-selected'), 'true');
  assert.deepEqual(await page.evaluate('brachy.onScreen([0, 0, 0])'), view);
  assert.equal(await page.evaluate('JSON.stringify(brachy.scanner)'), scanner);
  await page.locator('#plan-depth').blur();
  assert.equal((await plan()).change, 6);
});

test('a depth with which no seed would lie in the gland is refused in words, and the field shows the one in use', async () => {
  for (const text of ['685', '-5', '8', 'deep']) {
    await typeDepth(text);
    await page.locator('#toasts p', {hasText: /is no depth for G7: \d+ to \d+ mm beyond the template/}).last().waitFor();
    assert.equal(await page.locator('#plan-depth').inputValue(), '70.3', text);
  }
  assert.equal((await plan()).change, 6);
});

test('the holes have letters and numbers, and the gland lies behind them where the template has it', async () => {
  const labels = await page.locator('#plan-grid span').allTextContents();
  assert.deepEqual(labels.slice(0, 13), ['13', '12', '11', '10', '9', '8', '7', '6', '5', '4', '3', '2', '1']);
  assert.equal(labels.slice(13).join(''), 'MLKJIHGFEDCBA');
  // Where the gland's outline is on the page, against its box in the world at that depth: the outline reaches from one hole to another.
  const path = await page.locator('#plan-gland path[data-structure=prostate]').boundingBox();
  const holeAt = async (name) => {
    const box = await hole(name).boundingBox();
    return {x: box.x + box.width / 2, y: box.y + box.height / 2};
  };
  const [a1, b1, a2] = [await holeAt('A1'), await holeAt('B1'), await holeAt('A2')];
  const {origin, spacingMm} = await page.evaluate('brachy.template');
  const onPage = (x, y) => [a1.x + (b1.x - a1.x) * (x - origin[0]) / spacingMm, a1.y + (a2.y - a1.y) * (y - origin[1]) / spacingMm];
  const cut = await page.evaluate('brachy.glandBoxAt(brachy.planSectionMm)');
  const [[left, bottom], [right, top]] = [onPage(cut.high[0], cut.low[1]), onPage(cut.low[0], cut.high[1])];
  const off = [path.x - left, path.x + path.width - right, path.y - top, path.y + path.height - bottom].map(Math.abs);
  assert.ok(Math.max(...off) < 3, `${off} pixels`);  // the line's own width among them
});

test('holes are reached by the arrow keys, and Delete removes the needle of the chosen one', async () => {
  await hole('G7').focus();
  await page.keyboard.press('ArrowRight');  // seen from the feet: towards column A
  assert.equal(await page.evaluate('document.activeElement.dataset.hole'), 'F7');
  await page.keyboard.press('ArrowLeft');
  await page.keyboard.press('Delete');
  await changed(7);
  assert.equal(await needle('G7'), undefined);
  await comesTrue(page, `document.querySelector('#plan-needle').hidden`);
});

test('a removed needle comes back by Undo, with its depth and seeds, and goes again by Redo', async () => {
  await page.locator('#plan-undo').click();
  await changed(8);
  assert.equal((await needle('G7')).depthMm, 70.25);
  await hole('G7').focus();
  await page.keyboard.press('Control+z');  // the depth before
  await changed(9);
  assert.equal((await needle('G7')).depthMm, 68.5);
  await page.keyboard.press('Control+y');
  await changed(10);
  assert.equal((await needle('G7')).depthMm, 70.25);
  await page.locator('#plan-redo').click();
  await changed(11);
  assert.equal(await needle('G7'), undefined);
  await comesTrue(page, `document.querySelector('#plan-redo').disabled`);
});

test('the rest is optimised on request, and what is refused is said', async () => {
  await page.locator('#plan-optimise').click();
  await comesTrue(page, `document.querySelector('#plan-note').textContent.includes('being optimised') || brachy.plan.change === 12`);
  await changed(12);
  assert.equal((await plan()).kind, 2);
  const gland = await page.evaluate(`brachy.dose.withPlanned.find((each) => each.name === 'prostate').v100Percent`);
  assert.ok(gland > 90, `V100 ${gland} %`);
  await page.screenshot({path: join(artefacts, 'optimised.png')});
  await hole('A1').click();  // its needle passes beside the gland
  await comesTrue(page, `document.querySelector('#toasts').textContent.includes('does not pass through the gland')`);
  assert.equal((await plan()).change, 12);
});

test('nothing went wrong in the page', () => assert.deepEqual(errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text)), []));
