// Shipped exercises, done in the page alone by keys, mouse or touch: passed, begun again, failed by a planted mistake, and the result
// read each time. Exercises 01 and 02 here; BRACHY_EXERCISES names others (01,02,…) or "all", as scripts/campaigns/browser.sh does.
import assert from 'node:assert/strict';
import {mkdirSync, readdirSync, rmSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage, waitFor} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'exercises');
const scenes = fileURLToPath(new URL('../../config/exercises/scenes/', import.meta.url));
const sessions = join(artefacts, 'class');
/** But the volume study, which has a test of its own (volume_study.test.mjs). */
const WITH_NEEDLES = /^(?!11_)/;
const asked = process.env.BRACHY_EXERCISES ?? '01,02';
const exercises = readdirSync(scenes).filter((name) => name.endsWith('.toml') && WITH_NEEDLES.test(name) && (asked === 'all' || asked.split(',').includes(name.slice(0, 2)))).sort();
const ways = (process.env.BRACHY_WAYS ?? 'keys,mouse,touch').split(',');
/** Of a planted mistake. */
const SHALLOW_MM = 9;
/** Of keys, and of the wheel: a page that a busy machine draws seldom moves the needle at once by so much. */
const KEYS_MM = 3;
const WHEEL_MM = 0.5;

let browser, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  browser = await launch();
});
afterEach(async () => {  // also of a test that failed, so that it takes no time from the next one
  await page?.close();
  page = undefined;
  await Daemon.stopAll();
});
after(async () => {
  await browser?.close();
});

/** The page as each way of working uses it. All input is the browser's: keys, wheel, clicks and touches. */
class Trainee {
  /** How far the tip is from where the hand has it, mm: of catheters that have drifted. */
  driftMm = 0;

  constructor(page, way, drifts = false) {
    this.page = page;
    this.way = way;
    this.drifts = drifts;
  }

  async press(id) {
    const target = this.page.locator(id);
    if (this.way === 'keys') {
      await target.focus();
      await this.page.keyboard.press('Enter');
    } else if (this.way === 'touch') await target.tap();
    else await target.click();
  }

  async take() {
    await waitFor(async () => (await this.page.locator('#take').isEnabled()) && (await this.page.evaluate('brachy.heldNeedle')) < 0, () => this.page.locator('#hand-bar').textContent());
    if (this.way === 'keys') {
      await this.page.locator('#help-button').focus();
      await this.page.keyboard.press('n');
    } else await this.press('#take');
    await comesTrue(this.page, 'brachy.heldNeedle >= 0 && Number.isFinite(brachy.depthBeyondTemplateMm)');
    if (!this.drifts) return;
    await comesTrue(this.page, 'Math.abs(brachy.depthBeyondTemplateMm - brachy.handDepthMm) > 1');  // as the read-outs tell
    this.driftMm = await this.page.evaluate('brachy.depthBeyondTemplateMm - brachy.handDepthMm');
  }

  /** Lets go of the needle, which stays where it is. */
  async release() {
    if (this.way === 'keys') {
      await this.page.locator('#help-button').focus();
      await this.page.keyboard.press('n');
    } else await this.press('#take');
    await comesTrue(this.page, 'brachy.heldNeedle < 0');
  }

  /** A list that the system draws is beyond a page's mouse and touches: those choose by the list's own events. */
  async choose(hole) {
    const list = this.page.locator('#hole');
    if (this.way !== 'keys') await list.selectOption(hole);
    else await waitFor(async () => {
      await list.focus();
      await this.page.keyboard.press('Home');
      await this.page.keyboard.type(hole, {delay: 5});
      return (await list.inputValue()) === hole;
    }, () => list.inputValue());
    if ((await this.page.evaluate('brachy.heldNeedle')) < 0) return;
    const {origin, spacingMm} = await this.page.evaluate('brachy.template');  // the needle is drawn out before it goes across
    const [x, y] = [hole.charCodeAt(0) - 'A'.charCodeAt(0), Number(hole.slice(1)) - 1].map((step, axis) => origin[axis] + step * spacingMm);
    await comesTrue(this.page, `Math.abs(brachy.needle[3] - ${x}) < 0.01 && Math.abs(brachy.needle[7] - ${y}) < 0.01`);
  }

  /** Moves the tip to this depth beyond the template, within half a millimetre. */
  async goTo(mm) {
    const left = async () => mm - this.driftMm - (await this.page.evaluate('brachy.handDepthMm'));
    if (this.way === 'mouse') {
      const box = await this.page.locator('#scene').boundingBox();
      await this.page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      for (let rest = await left(); Math.abs(rest) > 0.3; rest = await left()) {
        await this.page.mouse.wheel(0, -Math.sign(rest) * 50 * Math.min(WHEEL_MM, Math.abs(rest)));
        await this.arrives();
      }
    } else if (this.way === 'keys') {
      await this.page.locator('#help-button').focus();
      for (let rest = await left(); Math.abs(rest) > 0.5; rest = await left()) {
        for (let i = 0; i < Math.max(1, Math.min(KEYS_MM, Math.floor(Math.abs(rest)))); ++i) await this.page.keyboard.press(rest > 0 ? 'PageUp' : 'PageDown');
        await this.arrives();
      }
    } else {
      for (let rest = await left(); Math.abs(rest) > 0.5; rest = await left()) {
        const button = rest > 0 ? '#advance' : '#withdraw';
        if (Math.abs(rest) < 6) await this.page.locator(button).tap();
        else await this.hold(button, async () => Math.abs(await left()) < 4 || Math.sign(await left()) !== Math.sign(rest));
      }
    }
    await comesTrue(this.page, `Math.abs(brachy.depthBeyondTemplateMm - ${mm}) < 1`);
  }

  /** A calm hand: the needle follows each step before the next. */
  arrives() {
    return comesTrue(this.page, `Math.abs(brachy.depthBeyondTemplateMm - brachy.handDepthMm - ${this.driftMm}) < 0.3`);
  }

  async hold(id, until) {
    this.touches ??= await this.page.context().newCDPSession(this.page);
    const box = await this.page.locator(id).boundingBox();
    await this.touches.send('Input.dispatchTouchEvent', {type: 'touchStart', touchPoints: [{x: box.x + box.width / 2, y: box.y + box.height / 2}]});
    await waitFor(until, () => 'the button was held');
    await this.touches.send('Input.dispatchTouchEvent', {type: 'touchEnd', touchPoints: []});
  }

  async drop() {
    if (this.way === 'keys') {
      await this.page.locator('#help-button').focus();
      await this.page.keyboard.press('s');
    } else await this.press('#drop');
  }

  /** The needles of the plan one after the other, `off` mm from their depths; `only` the first ones. */
  async implant({off = 0, only = Infinity} = {}) {
    const {needles} = await this.page.evaluate('brachy.plan');
    const planned = Object.values(await this.page.evaluate('brachy.plannedPositions'));
    let seeds = 0;
    for (const [number, {hole, depthMm}] of needles.entries()) {
      if (number >= only) break;
      await this.choose(hole);
      if (number === 0) await this.take();
      await this.goTo(depthMm + off);
      for (let left = planned.filter(({needle}) => needle === number).length; left > 0; --left) {
        await this.drop();
        seeds += 1;
        await comesTrue(this.page, `brachy.seeds.length >= ${seeds}`);
      }
    }
    await this.goTo(5);
  }

  /** The catheters of a fraction, which stay in. */
  async insert({only = Infinity} = {}) {
    const used = new Set();
    for (const [number, {hole, depthMm}] of (await this.page.evaluate('brachy.plannedNeedles')).entries()) {
      if (number >= only) break;
      await this.choose(hole);
      await this.take();
      const held = await this.page.evaluate('brachy.heldNeedle');
      assert.ok(!used.has(held), `catheter ${held} is in, and another was to be taken`);
      used.add(held);
      await this.goTo(depthMm);
      await this.release();
    }
  }

  /** Asks for the result, as often as it takes to get one of the session as it is now, and reads it. An earlier one is good for 2 s, and
   * catheters are looked at four times a second. `left`: those that are not in. */
  async result(passes, left = 0) {
    let result;
    const seeds = (await this.page.evaluate('brachy.seeds')).length;
    await waitFor(async () => {
      await this.press('#exercise-check');
      await comesTrue(this.page, 'brachy.exercise.result !== null && brachy.exercise.result.state !== "scoring"');
      result = await this.page.evaluate('brachy.exercise.result');
      const missing = Number(/catheters missing (\d+)/.exec(JSON.stringify(result))?.[1] ?? NaN);
      const placed = Number(/seeds placed (\d+)/.exec(JSON.stringify(result))?.[1] ?? NaN);
      return result.state === 'scored' && result.passed === passes && (Number.isNaN(missing) ? Number.isNaN(placed) || placed > 0 || seeds === 0 : missing === left);
    }, () => JSON.stringify(result));
    return {...result, said: await this.page.locator('#exercise-verdict').textContent(), lines: await this.page.locator('#exercise-lines li').allTextContents()};
  }
}

for (const [number, scene] of exercises.entries()) {
  const way = ways[number % ways.length];
  test(`${scene.replace('.toml', '')} by ${way}: passed, and begun again failed by a planted mistake`, async () => {
    const daemon = await Daemon.start(join(scenes, scene), join(artefacts, `${scene}.log`), undefined, ['--sessions', join(sessions, scene)]);
    page = await newPanelsPage(browser, {viewport: {width: 1366, height: 768}, hasTouch: way === 'touch'});
    page.on('pageerror', (error) => errors.push(error.message));
    await page.goto(`${daemon.url}?as=trainee`);
    await comesTrue(page, 'brachy.frames > 3 && brachy.plannedNeedles.length > 0 && brachy.exercise.offered.length > 0');
    const trainee = new Trainee(page, way, scene.startsWith('14_'));
    const needles = (await page.evaluate('brachy.plannedNeedles')).length;
    const isHdr = await page.evaluate('brachy.plan === null');

    await (isHdr ? trainee.insert() : trainee.implant());
    const passed = await trainee.result(true);
    await page.screenshot({path: join(artefacts, `${scene}-passed.png`)});
    assert.equal(passed.passed, true, JSON.stringify(passed));
    assert.equal(passed.said, 'Passed so far');

    await trainee.press('#exercise-again');
    await comesTrue(page, 'brachy.connection.phase === "open" && brachy.frames > 3 && brachy.seeds.length === 0 && brachy.exercise.result === null && brachy.needle === null && brachy.plannedNeedles.length > 0');
    if (isHdr) await trainee.insert({only: 1});
    else await trainee.implant(needles > 4 ? {only: 2} : {off: -SHALLOW_MM});
    const failed = await trainee.result(false, isHdr ? needles - 1 : 0);
    await page.screenshot({path: join(artefacts, `${scene}-failed.png`)});
    assert.equal(failed.passed, false, JSON.stringify(failed));
    assert.equal(failed.said, 'Not passed so far');
    assert.ok((failed.findings ?? []).some((text) => (isHdr ? /missing/ : needles > 4 ? /left no seed in place/ : /too shallow/).test(text)), JSON.stringify(failed.findings));
  });
}

test('nothing went wrong in the pages', () => assert.deepEqual(errors, []));
