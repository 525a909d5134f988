// An imported scene in the browser: structures in the file's colours with a legend that switches them, and slices of its images.
import assert from 'node:assert/strict';
import {mkdirSync, rmSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {comesTrue, differingPixels, launch, newQuickPage} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import {viewer} from './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'imported');
const [SIZE, STEP] = [[80, 70, 30], [1, 1, 2.5]];
const ORIGIN = [-40, -35, -36];

let browser, daemon, page, blank;
const errors = [];

/** As `brachy import` writes it: a volume of floats about the gland, with a bright ball in the middle. */
function writeScene() {
  const values = new Float32Array(SIZE[0] * SIZE[1] * SIZE[2]);
  for (let k = 0, at = 0; k < SIZE[2]; ++k)
    for (let j = 0; j < SIZE[1]; ++j)
      for (let i = 0; i < SIZE[0]; ++i, ++at) {
        const far = Math.hypot(...[i, j, k].map((n, a) => ORIGIN[a] + n * STEP[a]));
        values[at] = far < 10 ? 900 : 4 * i;
      }
  const header = `NRRD0004\ntype: float\ndimension: 3\nspace: right-anterior-superior\nsizes: ${SIZE.join(' ')}\nspace directions: (1,0,0) (0,1,0) (0,0,2.5)\nendian: little\nencoding: raw\nspace origin: (${ORIGIN.join(',')})\n\n`;
  writeFileSync(join(artefacts, 'volume.nrrd'), Buffer.concat([Buffer.from(header), Buffer.from(values.buffer)]));
  const cube = ['ply', 'format ascii 1.0', 'element vertex 4', 'property float x', 'property float y', 'property float z', 'element face 4',
    'property list uchar int vertex_indices', 'end_header', '32 0 0', '40 0 0', '32 8 0', '32 0 8', '3 0 2 1', '3 0 1 3', '3 1 2 3', '3 0 3 2', ''].join('\n');
  writeFileSync(join(artefacts, 'node.ply'), cube);
  writeFileSync(join(artefacts, 'scene.toml'), `name = "imported"
[tissue]
colour = "#33cc66"
[[structure]]
name = "node"
file = "node.ply"
colour = "#ff00ff"
[display]
volume = "volume.nrrd"
`);
}

before(async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  writeScene();
  daemon = await Daemon.start(join(artefacts, 'scene.toml'), join(artefacts, 'brachyd.log'));
  browser = await launch();
  blank = await browser.newPage();
  page = await newQuickPage(browser, {viewport: {width: 1280, height: 900}});
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && errors.push(message.text()));
  await page.emulateMedia({reducedMotion: 'reduce'});  // the camera does not travel
  await page.goto(daemon.url);
  await comesTrue(page, 'brachy.frames > 3 && brachy.volume !== null && brachy.structures.length > 0');
});
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

/** A picture of the scene once `act` shows. */
async function pictureAfter(act) {
  const before = await page.evaluate('brachy.pictures');
  await act();
  await comesTrue(page, `brachy.pictures > ${before}`);
  // That picture may have been under way already: the one with the change is drawn within the next two.
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return page.locator('#view').screenshot({mask: [page.locator('#legend'), page.locator('#views')]});
}
/** Red, green, blue and how many pixels are nearly so. */
const pixelsLike = (png, rgb) => blank.evaluate(async ([data, rgb]) => {
  const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
  context.drawImage(bitmap, 0, 0);
  const {data: pixels} = context.getImageData(0, 0, bitmap.width, bitmap.height);
  let count = 0;
  for (let i = 0; i < pixels.length; i += 4) if ([0, 1, 2].every((c) => Math.abs(pixels[i + c] - rgb[c]) <= 25)) ++count;
  return count;
}, [png.toString('base64'), rgb]);

test('the volume is fetched once, however often the page asks for other messages', async () => {
  const asked = [];
  const note = (request) => new URL(request.url()).pathname === '/volume' && asked.push(request.url());
  page.on('request', note);
  for (const tab of ['#tab-ultrasound', '#tab-needle', '#tab-ultrasound', '#tab-needle']) {
    await page.locator(tab).click();
    await comesTrue(page, `brachy.connection.phase === "open" && brachy.subscribesToUltrasound === ${tab.includes('ultrasound')}`);
  }
  await page.locator('#points').check();
  await comesTrue(page, 'brachy.connection.phase === "open"');
  await page.locator('#points').uncheck();
  const frames = await page.evaluate('brachy.frames');
  await comesTrue(page, `brachy.frames > ${frames + 10}`);
  page.off('request', note);
  assert.deepEqual(asked, []);
  assert.notEqual(await page.evaluate('brachy.volume'), null);
});

test('the daemon serves the volume about the box as words of 16 bits, where it lies', async () => {
  const answer = await fetch(new URL('volume', daemon.url));
  assert.equal(answer.headers.get('Content-Type'), 'application/octet-stream');
  const volume = viewer.parseVolume(new Uint8Array(await answer.arrayBuffer()));
  assert.deepEqual([volume.size, volume.origin, volume.steps], [SIZE, ORIGIN, [[1, 0, 0], [0, 1, 0], [0, 0, 2.5]]]);
  const value = (i, j, k) => volume.least + volume.step * volume.words[(k * SIZE[1] + j) * SIZE[0] + i];
  assert.ok(Math.abs(value(5, 3, 2) - 20) < 0.02 && Math.abs(value(40, 35, 14) - 900) < 0.02);
});

test('the legend names the structures in the colours of the scene', async () => {
  await page.locator('#legend-entries label').first().waitFor();
  const entries = await page.locator('#legend-entries label').evaluateAll((all) => all.map((label) => [label.textContent, getComputedStyle(label.querySelector('i')).backgroundColor]));
  assert.deepEqual(entries.map(([name]) => name), ['prostate', 'urethra', 'rectum', 'node']);
  assert.equal(entries[0][1], 'rgb(51, 204, 102)');
  assert.equal(entries[3][1], 'rgb(255, 0, 255)');
});

test('an entry of the legend switches its structure off and on', async () => {
  await page.locator('#opacity').fill('0.9');
  const all = await pictureAfter(() => page.locator('[data-view="coronal"]').click());
  for (const name of ['node', 'prostate']) {
    const box = page.locator(`#legend input[data-structure="${name}"]`);
    const without = await pictureAfter(() => box.uncheck());
    const changed = await differingPixels(blank, all, without);
    assert.ok(changed > (name === 'node' ? 100 : 10000), `${name}: ${changed} pixels`);
    const again = await pictureAfter(() => box.check());
    assert.ok((await differingPixels(blank, all, again)) < changed / 10, name);
  }
});

test('slices show the image at their place, with window and level', async () => {
  for (const name of ['prostate', 'urethra', 'rectum', 'node']) await page.locator(`#legend input[data-structure="${name}"]`).uncheck();
  const without = await pictureAfter(() => page.locator('[data-view="axial"]').click());
  const through = await pictureAfter(() => page.locator('#volume-axial').check());
  assert.ok((await differingPixels(blank, without, through)) > 20000, 'an axial slice');
  assert.equal(await page.locator('#volume-axial-mm').textContent(), '0.3 mm');
  const ball = await pixelsLike(through, [255, 255, 255]);
  assert.ok(ball > 1000, `${ball} white pixels of the ball`);
  const beside = await pictureAfter(() => page.locator('#volume-axial-at').fill('0.9'));
  const left = await pixelsLike(beside, [255, 255, 255]);
  assert.ok(left < ball / 2, `${left} white pixels above the ball, ${ball} in it`);
  const dark = await pictureAfter(async () => {
    await page.locator('#volume-level').fill('880');
    await page.locator('#volume-width').fill('50');
  });
  assert.ok((await pixelsLike(dark, [0, 0, 0])) > 10000, 'all below the window is black');
  assert.match(await page.locator('#volume-width-value').textContent(), /^50/);
  for (const plane of ['sagittal', 'coronal']) await page.locator(`#volume-${plane}`).check();
  await page.locator('#volume-axial-at').fill('0.5');
  await page.locator('#volume-level').fill('450');
  await page.locator('#volume-width').fill('900');
  for (const name of ['prostate', 'urethra', 'rectum', 'node']) await page.locator(`#legend input[data-structure="${name}"]`).check();
  await page.locator('#opacity').fill('0.45');
  await pictureAfter(() => page.locator('[data-view="reset"]').click());
  await page.screenshot({path: join(artefacts, 'imported.png')});
});

test('nothing went wrong in the page', () => assert.deepEqual(errors.filter((text) => !/WebSocket|ERR_CONNECTION|GPU stall|GL Driver/.test(text)), []));
