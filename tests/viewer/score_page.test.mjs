// The page of `brachy score` in a browser, of a session with mistakes: on a desktop, on a telephone and printed.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, writeFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {launch} from './browser.mjs';

const artefacts = resolve(process.env.BRACHY_ARTEFACTS ?? 'build/release/viewer-artefacts', 'score');
const sessions = fileURLToPath(new URL('../../scripts/campaigns/sessions.py', import.meta.url));
const SHEET_PX = ((297 - 2 * 9) * 96) / 25.4;       // A4 within the page's margins
const PRINTED_PX = Math.round(((210 - 2 * 11) * 96) / 25.4);

let browser, page;

before(async () => {
  mkdirSync(artefacts, {recursive: true});
  execFileSync('python3', [sessions, resolve(process.env.BRACHY ?? 'build/release/bin/brachy'), artefacts, '--quick', '--fresh', 'clinical_noise'], {stdio: 'ignore'});
  browser = await launch();
  page = await browser.newPage();
  await page.goto(pathToFileURL(join(artefacts, 'clinical_noise/report.html')).href);
});
after(() => browser?.close());

const width = () => page.evaluate('document.documentElement.scrollWidth');

test('it fits a desktop and a telephone', async () => {
  for (const pixels of [1280, 700, 390]) {
    await page.setViewportSize({width: pixels, height: 800});
    assert.ok((await width()) <= pixels, `${await width()} of ${pixels} pixels`);
    await page.screenshot({path: join(artefacts, `${pixels}.png`), fullPage: true});
  }
});

test('no figure is a negative zero, and no headline breaks', async () => {
  await page.setViewportSize({width: 1280, height: 800});
  const cells = await page.locator('td').evaluateAll((all) => all.map((cell) => cell.textContent));
  assert.ok(cells.length > 500);
  assert.deepEqual(cells.filter((text) => /(^|[( ])-0(\.0+)?($|[,) ])/.test(text)), []);
  for (const height of await page.locator('.keys b').evaluateAll((all) => all.map((b) => b.getClientRects()[0].height))) assert.ok(height < 26, `${height}`);
});

test('printed, the first sheet has findings, goals, slices and dose, and all of it four sheets', async () => {
  await page.emulateMedia({media: 'print'});
  await page.setViewportSize({width: PRINTED_PX, height: Math.floor(SHEET_PX)});
  const dose = await page.locator('.dose').boundingBox();
  assert.ok(dose.y + dose.height < SHEET_PX, `ends at ${dose.y + dose.height} of ${SHEET_PX}`);
  assert.ok((await page.locator('h2.next').first().boundingBox()).y > dose.y);
  const pdf = await page.pdf({preferCSSPageSize: true});
  writeFileSync(join(artefacts, 'score.pdf'), pdf);
  assert.equal(/\/Count (\d+)/.exec(pdf.toString('latin1'))?.[1], '4');
});
