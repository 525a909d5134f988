// The picture of the score's first sheet of scripts/charts/screenshots.sh: node score_screenshot.mjs REPORT.html PICTURE.png
import {pathToFileURL} from 'node:url';
import {launch} from './browser.mjs';

const [, , report, picture] = process.argv;
const browser = await launch();
const page = await browser.newPage({viewport: {width: 760, height: 1054}});
await page.goto(pathToFileURL(report).href);
await page.emulateMedia({media: 'print'});
const dose = await page.locator('.dose').boundingBox();
await page.screenshot({path: picture, clip: {x: 0, y: 0, width: 760, height: Math.ceil(dose.y + dose.height) + 8}});
await browser.close();
