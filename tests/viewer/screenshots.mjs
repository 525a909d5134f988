// The pictures of scripts/charts/screenshots.sh: node screenshots.mjs HTTP_ADDRESS ADDRESS WORK_FOLDER PICTURES_FOLDER
import {spawn} from 'node:child_process';
import {readFileSync} from 'node:fs';
import {join, resolve} from 'node:path';
import {pathToFileURL} from 'node:url';
import {comesTrue, launch} from './browser.mjs';
import {storePicture} from './picture.mjs';

const [, , http, address, work, pictures] = process.argv;
const browser = await launch();
const context = await browser.newContext({viewport: {width: 1280, height: 720}});
let page = await context.newPage();

const brachy = (...words) => {
  const child = spawn(process.env.BRACHY, words, {stdio: ['ignore', 'ignore', 'inherit']});
  return {child, done: new Promise((done) => child.once('exit', done))};
};
const until = (expression) => comesTrue(page, expression);
async function take(name) {
  await page.evaluate('document.activeElement?.blur()');  // no ring of the keyboard's focus
  await storePicture(page, join(pictures, `${name}.png`));
}
const settled = async () => until(`brachy.pictures > ${await page.evaluate('brachy.pictures')} + 2`);

await page.goto(`http://${http}/`);
await until('brachy.frames > 10');

// By hand, just before the capsule gives way.
await page.locator('#hole').selectOption({index: 1});
await page.locator('#take').click();
await until('brachy.needle !== null');
await page.locator('#scene').focus();
while (!(await page.evaluate('brachy.depthMm > 6'))) {
  const z = await page.evaluate('brachy.needle[11]');
  await page.keyboard.press('PageUp');
  await until(`brachy.needle[11] > ${z} + 0.95`);
}
await settled();
await take('needle');
await page.locator('#take').click();
await until('brachy.device === ""');

// A gland that is moved as a whole, and a plane through the needle's way.
await page.locator('#kernel').selectOption('elastic');
await until('brachy.model === "elastic"');
const recorder = brachy('record', '--connect', address, '--out', join(work, 'session.brachy'));
let needle = brachy('replay', 'config/insertion.csv', '--connect', address);
await needle.done;
recorder.child.kill('SIGINT');
await recorder.done;

await page.keyboard.press('x');
await page.locator('#clip-share').fill('0.4');
await page.locator('#scene').focus();
await until('brachy.points > 1200');
needle = brachy('replay', 'config/insertion.csv', '--connect', address);
await until('brachy.needle[11] < -30');
await until('brachy.needle[11] > 10');
await take('clipping-plane');
await needle.done;
await page.keyboard.press('x');

// A whole implant, quickly.
await page.locator('#kernel').selectOption('psi31');
await until('brachy.model === "psi31"');
await page.locator('#loop').click();
await page.locator('#play').click();
const lastRow = readFileSync(join(work, 'quick.csv'), 'utf8').trim().split('\n').at(-1);
const end = (await page.evaluate('performance.now()')) + 1000 * (Number.parseFloat(lastRow) + 3);
await until(`brachy.seeds.length === brachy.plannedSeeds || performance.now() > ${end}`);
await until('brachy.dose !== null && brachy.dose.seeds === brachy.seeds.length');
await page.keyboard.press('c');
await page.keyboard.press('d');
await settled();
await new Promise((done) => setTimeout(done, 1000));
await take('dose');

// On a tablet, without a daemon.
page = await context.newPage();
await page.setViewportSize({width: 1024, height: 768});
await page.goto(pathToFileURL(resolve('build/release/viewer/index.html')).href);
await page.locator('#file').setInputFiles(join(work, 'session.brachy'));
await until('brachy.recording.state === "ready"');
await page.locator('#pb-play').click();
await page.locator('#pb-seek').fill(String(Math.round(0.32 * (await page.evaluate('brachy.recording.durationS')))));
await page.locator('#toasts p').waitFor({state: 'detached'});
await new Promise((done) => setTimeout(done, 1000));
await take('recording');
await browser.close();
