// The viewer's protocol as the build leaves it for node; without it there is nothing to test.
import {existsSync} from 'node:fs';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

export const viewerFolder = process.env.BRACHY_VIEWER ?? 'build/release/viewer';

const file = join(viewerFolder, 'protocol/protocol.mjs');
if (!existsSync(file)) {
  console.log('skipped: the viewer is not built (npm or its registry was missing)');
  process.exit(77);
}
export const viewer = await import(pathToFileURL(file));
