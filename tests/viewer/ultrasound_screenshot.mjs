// The picture of the ultrasound console of scripts/charts/screenshots.sh, of a daemon that plays config/insertion.csv:
// node ultrasound_screenshot.mjs HTTP_ADDRESS PICTURES_FOLDER
import {join} from 'node:path';
import {comesTrue, launch} from './browser.mjs';
import {storePicture} from './picture.mjs';

const [, , http, pictures] = process.argv;
const browser = await launch();
const context = await browser.newContext({viewport: {width: 1280, height: 720}});
const page = await context.newPage();
page.on('pageerror', (error) => console.error(error.message));
const until = (expression) => comesTrue(page, expression);

await page.goto(`http://${http}/`);
await until('brachy.frames > 3');
await page.locator('#tab-ultrasound').click();
await until('brachy.images.length === 1');
await page.locator('#us-array button[data-value="4"]').click();
await page.locator('#opacity').fill('0.25');
await until('brachy.images.length === 2 && brachy.needle !== null && brachy.needle[11] > 0');
await page.locator('#us-freeze').click();
await until('brachy.images.every((image) => image.frozen)');
const box = await page.locator('#us-first').boundingBox();
await page.mouse.move(box.x + 0.3 * box.width, box.y + 0.52 * box.height);
await page.mouse.down();
await page.mouse.move(box.x + 0.7 * box.width, box.y + 0.52 * box.height, {steps: 5});
await page.mouse.up();
const scene = await page.locator('#scene').boundingBox();
await page.mouse.move(scene.x + scene.width / 2, scene.y + scene.height / 2);
for (let i = 0; i < 5; ++i) await page.mouse.wheel(0, 150);
await page.evaluate('document.activeElement?.blur()');
await until(`brachy.pictures > ${await page.evaluate('brachy.pictures')} + 1 || brachy.pictures > 5`);
await storePicture(page, join(pictures, 'ultrasound.png'));
await browser.close();
