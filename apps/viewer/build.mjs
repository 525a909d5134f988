// Bundles the viewer into one page that needs nothing beside it.
//   node build.mjs [--out DIR]     DIR/index.html and DIR/index.html.gz; default: dist
//   node build.mjs --protocol FILE also the protocol and the player as a module for node, which the tests read
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {gzipSync} from 'node:zlib';
import {build} from 'esbuild';

const MOST_BYTES = 250_000;  // gzipped
const here = dirname(fileURLToPath(import.meta.url));
const {values} = parseArgs({options: {out: {type: 'string', default: join(here, 'dist')}, protocol: {type: 'string'}}});
const {version} = JSON.parse(readFileSync(join(here, 'package.json'), 'utf8'));
// The ψ kernels, which have a support radius: the list of core/kernels.
const kernels = readFileSync(join(here, '../../core/kernels/kernels.h'), 'utf8').matchAll(/kName = "(\w+)"/g);
const define = {VIEWER_VERSION: JSON.stringify(version), PSI_KERNELS: JSON.stringify([...kernels].map((found) => found[1]))};
const common = {bundle: true, define, target: 'es2022', logLevel: 'warning', legalComments: 'none', absWorkingDir: here};

const script = await build({...common, entryPoints: ['src/main.ts'], minify: true, format: 'iife', write: false, outdir: 'unused',
                            loader: {'.css': 'css'}, banner: {js: '/* three.js and uPlot: MIT licence */'}});
const text = (ending) => script.outputFiles.filter((file) => file.path.endsWith(ending)).map((file) => file.text).join('\n');
const style = await build({...common, stdin: {contents: `${text('.css')}\n${readFileSync(join(here, 'src/style.css'), 'utf8')}`, loader: 'css'}, minify: true, write: false});
const fill = (page, mark, content) => page.split(mark).join(content);
let page = readFileSync(join(here, 'src/index.html'), 'utf8');
page = fill(page, '/*STYLE*/', style.outputFiles[0].text.trim());
// The frame of the page is painted before three.js is read.
const soon = `requestAnimationFrame(()=>setTimeout(()=>{${text('.js').trim()}}))`;
page = fill(page, '/*SCRIPT*/', soon.replaceAll('</script', '<\\/script'));

const zipped = gzipSync(page, {level: 9});
mkdirSync(values.out, {recursive: true});
console.log(`viewer: ${(page.length / 1000).toFixed(1)} kB, ${(zipped.length / 1000).toFixed(1)} kB gzipped (at most ${MOST_BYTES / 1000})`);
if (zipped.length > MOST_BYTES) {
  console.error('viewer: the page is too large');
  process.exit(1);
}
writeFileSync(join(values.out, 'index.html.gz'), zipped);
writeFileSync(join(values.out, 'index.html'), page);

if (values.protocol)
  await build({...common, entryPoints: ['src/testing.ts'], format: 'esm', platform: 'node', outfile: values.protocol});
