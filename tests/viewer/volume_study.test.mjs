// The volume study: outlining by mouse and keys, first the model without a page, then the page in front of the daemon.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdirSync, readFileSync, rmSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {comesTrue, launch, newPanelsPage} from './browser.mjs';
import {Daemon} from './daemon.mjs';
import {viewer} from './viewer_module.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'study');
const exercises = fileURLToPath(new URL('../../config/exercises/', import.meta.url));
const brachy = process.env.BRACHY ?? 'build/release/bin/brachy';
const session = join(artefacts, 'session');

/** A frozen image 200 × 200 across z, 0.5 mm a pixel. */
const image = (z, more = {}) => ({width: 200, height: 200, spacingMm: 0.5, tick: 100 + z, pose: Float64Array.of(1, 0, 0, -50, 0, -1, 0, 50, 0, 0, -1, z), ...more});
const circle = (count, radius = 40) => Array.from({length: count}, (_, i) => ({x: 100 + radius * Math.cos((2 * Math.PI * i) / count), y: 100 + radius * Math.sin((2 * Math.PI * i) / count)}));
const areaOf = (points) => Math.abs(points.reduce((sum, [x, y], i) => {
  const [nextX, nextY] = points[(i + 1) % points.length];
  return sum + x * nextY - y * nextX;
}, 0)) / 2;

test('a closed curve through twelve points has the area of their circle to 1 %', () => {
  const curve = viewer.closedCurve(circle(12)).map(({x, y}) => [x, y]);
  assert.equal(curve.length, 96);
  assert.ok(Math.abs(areaOf(curve) / (Math.PI * 1600) - 1) < 0.01, `${areaOf(curve) / (Math.PI * 1600)}`);
});

test('points are added, moved, inserted where the curve passes, removed, and each change is taken back', () => {
  const study = new viewer.VolumeStudy();
  const at = image(0);
  for (const point of circle(8)) {
    study.press(at, point, 5, 0);
    study.release();
  }
  assert.equal(study.handles(at).points.length, 8);
  const [first] = circle(8);
  study.press(at, first, 5, 0);
  study.drag(at, {x: first.x + 6, y: first.y});
  study.release();
  assert.ok(Math.abs(study.handles(at).points[0].x - first.x - 6) < 1e-9);
  study.undo(at);
  assert.ok(Math.abs(study.handles(at).points[0].x - first.x) < 1e-9);
  const between = circle(16)[1];  // on the curve, between the first two
  study.press(at, between, 5, 0);
  study.release();
  assert.deepEqual([study.handles(at).points.length, study.handles(at).selected], [9, 1]);
  study.nudge(at, 2, 0, 0);
  assert.ok(Math.abs(study.handles(at).points[1].x - between.x - 2) < 1e-9);
  study.remove(at, 0);
  assert.equal(study.handles(at).points.length, 8);
  study.discard(at, 0);
  assert.equal(study.slices.length, 0);
  study.undo(at);
  assert.equal(study.handles(at).points.length, 8, 'an outline that was discarded comes back');
});

test('each plane has its own outline, which another depth shows in its place, and CONTOUR has them in mm', () => {
  const study = new viewer.VolumeStudy();
  for (const z of [0, 5])
    for (const point of circle(12)) {
      study.press(image(z), point, 2, z);
      study.release();
    }
  assert.deepEqual(study.slices.map(({number, tick, points}) => [number, tick, points.length]), [[0, 100, 12], [1, 105, 12]]);
  const deeper = image(5, {spacingMm: 1, tick: 300});
  const [shown] = study.handles(deeper).points;
  assert.ok(Math.abs(shown.x - 70) < 1e-9 && Math.abs(shown.y - 50) < 1e-9);
  assert.equal(study.sliceOf(image(10)), null);
  const body = Buffer.from(viewer.encodeContour(study.outlines()));
  const {slices, score} = viewer.decodeContour(body);
  assert.equal(score, null);
  assert.deepEqual(slices.map(({slice, tick, probeDepthMm}) => [slice, tick, probeDepthMm]), [[0, 100, 0], [1, 105, 5]]);
  assert.ok(Math.abs(areaOf(slices[1].points) / (Math.PI * 400) - 1) < 0.01);
});

test('a click far outside makes no spike, and one beside the image nothing, wherever the outline is', () => {
  for (const radius of [25, 40, 60])
    for (let turn = 0; turn < 8; ++turn) {
      const study = new viewer.VolumeStudy();
      const points = circle(10, radius);
      for (let i = 0; i < 10; ++i) assert.ok(study.press(image(0), points[(i + turn) % 10], 3, 0), `point ${i} of a circle of ${radius} pixels`);
      study.release();
      const area = areaOf(study.outlines()[0].points);
      const angle = turn * 0.8 + 0.1;
      const far = {25: 80, 40: 95, 60: 75}[radius];
      assert.equal(study.press(image(0), {x: 100 + far * Math.cos(angle), y: 100 + far * Math.sin(angle)}, 3, 0), radius === 60, `${radius}, ${angle}`);
      if (radius !== 60) assert.equal(areaOf(study.outlines()[0].points), area);
      for (const beside of [{x: -20, y: 100}, {x: 100, y: 230}]) assert.equal(study.press(image(0), beside, 3, 0), false);
    }
});

test('points clicked in turn around a slender gland stay in their order', () => {
  const slender = Array.from({length: 14}, (_, i) => ({x: 100 + 60 * Math.cos((2 * Math.PI * i) / 14), y: 100 + 25 * Math.sin((2 * Math.PI * i) / 14)}));
  const study = new viewer.VolumeStudy();
  for (const point of slender) {
    assert.ok(study.press(image(0), point, 3, 0));
    study.release();
  }
  study.handles(image(0)).points.forEach(({x, y}, i) => assert.ok(Math.hypot(x - slender[i].x, y - slender[i].y) < 1e-9, `point ${i}`));
});

test('outlines come back as they were kept, and what was not kept so does nothing', () => {
  const study = new viewer.VolumeStudy();
  for (const z of [0, 5]) for (const point of circle(8)) study.press(image(z), point, 2, z);
  const again = new viewer.VolumeStudy();
  again.restore(study.kept());
  assert.deepEqual(again.outlines(), study.outlines().map((slice) => ({...slice, pose: Array.from(slice.pose)})));
  for (const point of circle(8)) again.press(image(10), point, 2, 10);
  assert.deepEqual(again.slices.map(({number}) => number), [0, 1, 2]);
  for (const text of ['', '{}', '[{}]', '[{"pose": [1]}]', 'null']) {
    again.restore(text);
    assert.equal(again.slices.length, 3, text);
  }
});

test('three keys make an outline, and further ones go between', () => {
  const study = new viewer.VolumeStudy();
  for (let i = 0; i < 5; ++i) study.insert(image(0), 0);
  assert.equal(study.outlines().length, 1);
  assert.ok(areaOf(study.outlines()[0].points) > 100);
  study.select(image(0), 1);
  assert.equal(study.handles(image(0)).selected, 0);
});

let browser, daemon;
after(async () => {
  await browser?.close();
  await daemon?.stop();
});

test('an operator outlines two slices by mouse and keys, and gets the score that the session keeps', async () => {
  rmSync(artefacts, {recursive: true, force: true});
  mkdirSync(artefacts, {recursive: true});
  const exercise = join(exercises, '11_volume_study.toml');
  daemon = await Daemon.start(join(exercises, 'scenes/11_volume_study.toml'), join(artefacts, 'brachyd.log'), undefined, ['--session', session]);
  browser = await launch();
  const errors = [];
  const page = await newPanelsPage(browser, {viewport: {width: 1280, height: 900}});
  page.on('pageerror', (error) => errors.push(error.message));
  const until = (expression) => comesTrue(page, expression);
  await page.goto(daemon.url);
  await until('brachy.frames > 3');
  await page.locator('#tab-ultrasound').click();
  await until('brachy.images.length === 1');
  await page.keyboard.press('v');
  await until('brachy.study.on && brachy.images[0]?.frozen && brachy.frozenOnScreen === brachy.images[0].tick');
  await page.locator('#us-first').waitFor();
  const box = await page.locator('#us-first').boundingBox();
  const scale = Math.min(box.width, box.height) / 512;
  const onScreen = (x, y) => [box.x + box.width / 2 + scale * (x - 256), box.y + box.height / 2 + scale * (y - 256)];
  const outline = async (points, half) => {
    for (let i = 0; i < points; ++i) {
      const angle = (2 * Math.PI * i) / points;
      await page.mouse.click(...onScreen(256 + half * Math.cos(angle), 270 + 0.8 * half * Math.sin(angle)));
    }
  };
  await outline(8, 130);
  await until('brachy.study.slices.length === 1 && brachy.study.slices[0].points === 8');
  await page.keyboard.press('Enter');
  await until('brachy.study.slices[0].points === 9');
  await page.keyboard.press('Delete');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Control+z');
  await until('brachy.study.slices[0].points === 8');
  const at = (await page.evaluate('brachy.images'))[0].pose[11];
  await page.keyboard.press('+');
  await until(`brachy.scanner.probeDepthMm === 5 && brachy.images[0]?.frozen === false && Math.abs(brachy.images[0].pose[11] - ${at} - 5) < 0.01`);
  await page.keyboard.press('f');
  await until('brachy.images[0]?.frozen && brachy.frozenOnScreen === brachy.images[0].tick');
  await outline(8, 120);
  await until('brachy.study.slices.length === 2 && brachy.study.slices[1].points === 8');
  // The page is loaded again, as a hand does by mistake: the outlines are still there.
  await page.reload();
  await until('brachy.frames > 3');
  await page.locator('#tab-ultrasound').click();
  await until('brachy.images.length === 1 && brachy.study.slices.length === 2');
  assert.deepEqual(await page.evaluate('brachy.study.slices.map((slice) => slice.points)'), [8, 8]);
  await page.locator('#us-finish').click();
  await until('brachy.study.score !== null');
  const {score, truth} = await page.evaluate('brachy.study');
  assert.ok(score.dice > 0.2 && score.dice < 1, `Dice ${score.dice}`);
  assert.equal(score.stepMm.toFixed(2), '5.00');
  assert.ok(score.missed > 2 && truth >= score.missed, 'the planes that nobody outlined');
  assert.ok(score.trueCm3 > 20 && score.trueCm3 < 80);
  await page.locator('#right').screenshot({path: join(artefacts, 'study.png')});
  assert.deepEqual(errors, []);

  const kept = readFileSync(join(session, 'volume_studies.jsonl'), 'utf8').trim().split('\n').map((line) => JSON.parse(line));
  assert.equal(kept.length, 1);
  assert.equal(kept[0].planes.length, score.planes.length);
  const scored = spawnSync(brachy, ['score', session, '--exercise', exercise, '--json'], {encoding: 'utf8'});
  assert.equal(scored.status, 1, `two slices do not pass: ${scored.stderr}`);
  const report = JSON.parse(scored.stdout.split('\n').find((line) => line.startsWith('{')));
  assert.ok(Math.abs(report.volume_studies[0].dice - score.dice) < 1e-12);
});
