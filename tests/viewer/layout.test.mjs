// The page's three layouts at ten sizes: nothing is cut off, nothing lies over another, and axe finds nothing. The debrief's
// sizes are in debrief.test.mjs, which plays the sessions for it.
import assert from 'node:assert/strict';
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {after, afterEach, before, beforeEach, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import {SIZES, misplaced} from './misplaced.mjs';
import './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'layout');
const exercises = fileURLToPath(new URL('../../config/exercises/', import.meta.url));
const axe = readFileSync(createRequire(new URL('../../apps/viewer/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');

let browser, daemon, page;
const errors = [];

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  const scene = join(artefacts, 'scene.toml');
  writeFileSync(scene, `name = "layout"\n[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n[plan]\nfile = "${exercises}plans/02_one_train.toml"\n[seeds]\napplicator = "train"\n`);
  // An exercise beside the scene, so that the tab is there.
  writeFileSync(join(artefacts, 'task.toml'), readFileSync(join(exercises, '02_one_train.toml'), 'utf8').replace(/^scene = .*$/m, 'scene = "scene.toml"'));
  daemon = await Daemon.start(scene, join(artefacts, 'brachyd.log'), undefined, ['--sessions', join(artefacts, 'class')]);
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
    for (const [width, height] of SIZES) {
      await page.setViewportSize({width, height});
      await page.goto(`${daemon.url}?as=${layout}`);
      await comesTrue(page, 'brachy.frames > 2 && brachy.exercise.offered.length > 0 && brachy.plan !== null');
      await page.evaluate('document.fonts.ready');
      // Of a page whose connection holds: a busy machine may end it, and what says so lies over the page.
      const note = async (where) => {
        let texts;
        do {
          await comesTrue(page, 'document.getElementById("banner").hidden');
          texts = await misplaced(page);
        } while (await visible('#banner'));
        found.push(...texts.map((text) => `${width} × ${height}, ${where}: ${text}`));
      };
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
