// The picture of bent needle, probe and moved gland of scripts/charts/screenshots.sh, of a daemon that plays
// config/insertion_probe.csv: node theatre_screenshot.mjs HTTP_ADDRESS PICTURES_FOLDER
import {join} from 'node:path';
import {comesTrue, launch} from './browser.mjs';
import {storePicture} from './picture.mjs';

const [, , http, pictures] = process.argv;
const browser = await launch();
const context = await browser.newContext({viewport: {width: 1280, height: 720}});
const page = await context.newPage();
const until = (expression) => comesTrue(page, expression);

await page.goto(`http://${http}/`);
await until('brachy.frames > 10');
await page.locator('#clip-share').fill('0.6');
await page.locator('#scene').focus();
await page.keyboard.press('x');
await until('brachy.needle !== null && brachy.needle[11] > 12');
await page.evaluate('document.activeElement?.blur()');
await until(`brachy.pictures > ${await page.evaluate('brachy.pictures')} + 2`);
await storePicture(page, join(pictures, 'theatre.png'));
await browser.close();
