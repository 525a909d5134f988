// Debian's chromium, rendering in software.
import {existsSync} from 'node:fs';
import {createRequire} from 'node:module';

const EXECUTABLE = process.env.BRACHY_CHROMIUM ?? '/usr/bin/chromium';
// Only the scene is WebGL's: with the page composed by it too, there are half as many pictures a second.
const ARGUMENTS = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
                   '--disable-gpu-compositing'];

if (!existsSync(EXECUTABLE)) {
  console.log(`skipped: ${EXECUTABLE} is missing; scripts/setup.sh --all installs it`);
  process.exit(77);
}
const {chromium} = createRequire(new URL('../../apps/viewer/package.json', import.meta.url))('playwright-core');

export const launch = () => chromium.launch({executablePath: EXECUTABLE, args: ARGUMENTS});

/** A page that draws the scene without antialiasing, which is half of what a picture takes in software. */
export async function newQuickPage(browser, options = {}) {
  const page = await browser.newPage(options);
  await page.addInitScript(() => {
    const getContext = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, wishes) {
      return getContext.call(this, kind, kind.startsWith('webgl') ? {...wishes, antialias: false} : wishes);
    };
  });
  return page;
}

const PATIENCE_MS = Number(process.env.BRACHY_PATIENCE_MS ?? 180000);  // only ends a test that would hang
const WHERE = 'JSON.stringify([brachy.connection, brachy.frames, brachy.tick, brachy.needle, brachy.recording, document.getElementById("hand-note")?.textContent])';

/** Asks again and again until `condition()` holds; `what` describes it where it never does. */
export async function waitFor(condition, what) {
  for (const start = Date.now(); Date.now() - start < PATIENCE_MS;) {
    if (await condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 30));
  }
  throw new Error(`never came true: ${await what()}`);
}

/** Waits until `expression` of window.brachy holds; asks from outside, as the page's security policy evaluates no text. */
export const comesTrue = (page, expression) =>
  waitFor(() => page.evaluate(`typeof brachy !== 'undefined' && (${expression})`), async () => `${expression}; ${await page.evaluate(WHERE)}`);

/** A quick page whose scene takes no time in software, because it is not drawn: for tests of all else in the page. */
export async function newPanelsPage(browser, options = {}) {
  const page = await newQuickPage(browser, options);
  await page.addInitScript(() => {
    for (const name of ['drawElements', 'drawArrays']) WebGL2RenderingContext.prototype[name] = () => {};
  });
  return page;
}

/** How many pixels of two PNGs clearly differ; `blank` is an empty page, whose browser decodes them. */
export const differingPixels = (blank, ...pngs) => blank.evaluate(async (sources) => {
  const [a, b] = await Promise.all(sources.map(async (data) => {
    const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
  }));
  let count = 0;
  for (let i = 0; i < a.length; i += 4)
    if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > 40) ++count;
  return count;
}, pngs.map((png) => png.toString('base64')));
