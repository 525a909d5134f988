// The page's three layouts at ten sizes: nothing is cut off, nothing lies over another, and axe finds nothing.
import assert from 'node:assert/strict';
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {after, afterEach, before, beforeEach, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import {playSession} from './played_sessions.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'layout');
const exercises = fileURLToPath(new URL('../../config/exercises/', import.meta.url));
const axe = readFileSync(createRequire(new URL('../../apps/viewer/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');
const SIZES = [[390, 844], [844, 390], [768, 1024], [1024, 768], [1280, 720], [1366, 768], [1920, 1080], [2560, 1440]];
const ZOOMED = [[683, 384], [960, 540]];  // 1366 × 768 and 1920 × 1080 at 200 %

let browser, daemon, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  const scene = join(artefacts, 'scene.toml');
  writeFileSync(scene, `name = "layout"\n[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n[plan]\nfile = "${exercises}plans/02_one_train.toml"\n[seeds]\napplicator = "train"\n`);
  // An exercise beside the scene, so that the tab is there.
  writeFileSync(join(artefacts, 'task.toml'), readFileSync(join(exercises, '02_one_train.toml'), 'utf8').replace(/^scene = .*$/m, 'scene = "scene.toml"'));
  const sessions = join(artefacts, 'class');
  await playSession(join(artefacts, 'played'), sessions, 'urethra', 'a trainee with a name that is as long as some are');
  daemon = await Daemon.start(scene, join(artefacts, 'brachyd.log'), undefined, ['--sessions', sessions]);
  browser = await launch();
});
beforeEach(async () => {  // a page that has drawn in software for minutes takes much memory
  const context = await browser.newContext({bypassCSP: true});  // axe is a script that the page's policy does not know
  page = await newPanelsPage(context, {});
  page.on('pageerror', (error) => errors.push(error.message));
});
afterEach(() => page.context().close());
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

/** Elements that are cut off, or lie over another, in the page as it is shown. */
const misplaced = () => page.evaluate(() => {
  const found = [];
  const name = (element) => `${element.tagName.toLowerCase()}${element.id ? `#${element.id}` : ''} "${(element.textContent ?? '').trim().slice(0, 30)}"`;
  const shown = (element) => element.checkVisibility({checkVisibilityCSS: true, checkOpacity: true}) && element.getBoundingClientRect().width > 0;
  /** The nearest ancestor that scrolls in a direction, whose content may be longer than itself. */
  const scrolls = (element, axis) => {
    for (let host = element.parentElement; host && host !== document.body; host = host.parentElement)
      if (/auto|scroll/.test(getComputedStyle(host)[`overflow${axis}`])) return host;
    return null;
  };
  const parts = [...document.querySelectorAll('button, select, input, output, dd, dt, h1, h2, h3, p, li, label, summary, th, td, .pill, canvas')].filter(shown);
  for (const element of parts) {
    const box = element.getBoundingClientRect();
    const [beyondX, beyondY] = [scrolls(element, 'X'), scrolls(element, 'Y')];
    // Nothing scrolls sideways: also what is in a panel that scrolls stays within its width.
    const [left, right] = beyondX ? [beyondX.getBoundingClientRect().left, beyondX.getBoundingClientRect().right] : [0, innerWidth];
    if (box.left < left - 1 || box.right > right + 1) found.push(`${name(element)} is cut off sideways: ${Math.round(box.left)} to ${Math.round(box.right)} of ${Math.round(left)} to ${Math.round(right)}`);
    if (!beyondY && (box.top < -1 || box.bottom > innerHeight + 1)) found.push(`${name(element)} is cut off: ${Math.round(box.top)} to ${Math.round(box.bottom)} of ${innerHeight}`);
    if (element.matches('button, label, h2, h3, dd, dt, output') && element.scrollWidth > element.clientWidth + 1 && getComputedStyle(element).display !== 'inline')
      found.push(`${name(element)}: ${element.scrollWidth} px of text in ${element.clientWidth}`);
  }
  const drawerOf = (element) => {
    const host = element.closest('#left.open, #right.open');
    return host && getComputedStyle(host).position === 'absolute' ? host : null;
  };
  // Of things to press none lies over another; in a panel that scrolls only what is in sight counts.
  const press = [...document.querySelectorAll('button, select, input, summary')].filter(shown).filter((element) => {
    const box = element.getBoundingClientRect();
    const host = scrolls(element, 'Y')?.getBoundingClientRect();
    return !host || (box.top >= host.top && box.bottom <= host.bottom);
  });
  for (const [i, a] of press.entries()) {
    const one = a.getBoundingClientRect();
    for (const b of press.slice(0, i)) {
      const two = b.getBoundingClientRect();
      if (drawerOf(a) !== drawerOf(b)) continue;  // a drawer lies over the scene, as drawers do
      const across = Math.min(one.right, two.right) - Math.max(one.left, two.left);
      const down = Math.min(one.bottom, two.bottom) - Math.max(one.top, two.top);
      if (across > 2 && down > 2 && !a.contains(b) && !b.contains(a)) found.push(`${name(a)} lies over ${name(b)}`);
    }
  }
  return found;
});

const visible = (id) => page.locator(id).isVisible();

/** Every panel of the layout, one after the other. */
async function tabs(check) {
  for (const tab of ['needle', 'dose', 'plan', 'ultrasound', 'exercise', 'debrief']) {
    if (!(await visible(`#tab-${tab}`))) continue;
    await page.locator(`#tab-${tab}`).click();
    if (tab === 'ultrasound') await comesTrue(page, 'brachy.images.length > 0');
    if (tab === 'plan') await page.locator('#plan-grid button.planned').first().click();
    await check(tab);
  }
}

const only = process.env.BRACHY_LAYOUT;
for (const layout of ['trainee', 'trainee&exam', 'teacher', 'research'].filter((each) => !only || each === only))
  test(`as ${layout}: nothing is cut off or covered from 390 to 2560 pixels, and at 200 %`, async () => {
    const found = [];
    for (const [width, height] of [...SIZES, ...ZOOMED]) {
      await page.setViewportSize({width, height});
      await page.goto(`${daemon.url}?as=${layout}`);
      await comesTrue(page, 'brachy.frames > 2 && brachy.exercise.offered.length > 0 && brachy.plan !== null');
      await page.evaluate('document.fonts.ready');
      const note = async (where) => found.push(...(await misplaced()).map((text) => `${width} × ${height}, ${where}: ${text}`));
      await note('as it opens');
      // On a small screen panels are drawers.
      for (const side of ['left', 'right']) {
        if (!(await visible(`#toggle-${side}`))) continue;
        await page.locator(`#toggle-${side}`).click();
        await page.locator(`#${side}`).evaluate((drawer) => Promise.all(drawer.getAnimations().map((each) => each.finished)));
        if (side === 'left') {
          await page.screenshot({path: join(artefacts, `${layout.replace('&', '-')}-${width}-drawer.png`)});
          await page.locator('#toggle-left').click();
          await page.locator('#left').evaluate((drawer) => Promise.all(drawer.getAnimations().map((each) => each.finished)));
        }
      }
      await tabs(note);
      await page.screenshot({path: join(artefacts, `${layout.replace('&', '-')}-${width}.png`)});
    }
    assert.deepEqual(found, []);
  });

test('the debrief of a session, and one beside it: nothing is cut off or covered either', {skip: only && only !== 'debrief'}, async () => {
  const found = [];
  for (const [width, height] of [...SIZES, ...ZOOMED]) {
    await page.setViewportSize({width, height});
    await page.goto(`${daemon.url}?as=teacher&session=0001_urethra#t=3`);
    await comesTrue(page, 'brachy.recording.state === "ready" && brachy.debrief.findings.length > 0');
    const note = async (where) => found.push(...(await misplaced()).map((text) => `${width} × ${height}, ${where}: ${text}`));
    const settled = () => page.locator('#right').evaluate((drawer) => Promise.all(drawer.getAnimations().map((each) => each.finished)));
    await note('time line');
    if (await visible('#toggle-right')) await page.locator('#toggle-right').click();
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

test('axe finds nothing, in any layout and panel', async () => {
  await page.setViewportSize({width: 1366, height: 900});
  const found = [];
  for (const layout of ['trainee', 'teacher', 'research']) {
    await page.goto(`${daemon.url}?as=${layout}`);
    await comesTrue(page, 'brachy.frames > 2 && brachy.exercise.offered.length > 0');
    await page.evaluate(axe);
    await tabs(async (tab) => {
      const {violations} = await page.evaluate('axe.run()');
      found.push(...violations.map(({id, nodes}) => `${layout}, ${tab}: ${id}: ${nodes.map(({target, any}) => `${target} ${any[0]?.message ?? ''}`).join('; ')}`));
    });
  }
  assert.deepEqual(found, []);
});

test('an examination hides the 3-D view and the plan, and the switch on top brings them back', async () => {
  await page.goto(`${daemon.url}?as=trainee`);
  await comesTrue(page, 'brachy.frames > 2');
  assert.equal(await visible('#scene'), true);
  assert.match(await page.locator('#exercise-next').textContent(), /Take the needle/);
  await page.locator('#exam').click();
  assert.deepEqual([await visible('#scene'), await visible('#us-first'), await page.locator('#exercise-next').textContent()], [false, true, '']);
  await page.locator('#as [data-as=research]').click();
  assert.deepEqual([await visible('#scene'), await visible('#c-depth'), await visible('#exam')], [true, true, false]);
  assert.equal(new URL(page.url()).searchParams.get('as'), 'research');
});

test('nothing went wrong in the page', () => assert.deepEqual(errors, []));
