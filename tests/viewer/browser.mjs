// Debian's chromium, rendering in software.
import {existsSync} from 'node:fs';
import {createRequire} from 'node:module';

const EXECUTABLE = process.env.BRACHY_CHROMIUM ?? '/usr/bin/chromium';
const ARGUMENTS = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];

if (!existsSync(EXECUTABLE)) {
  console.log(`skipped: ${EXECUTABLE} is missing; scripts/setup.sh --all installs it`);
  process.exit(77);
}
const {chromium} = createRequire(new URL('../../apps/viewer/package.json', import.meta.url))('playwright-core');

export const launch = () => chromium.launch({executablePath: EXECUTABLE, args: ARGUMENTS});
