#!/usr/bin/env bash
# A scripted teacher finds the mistake of each of ten recorded sessions within three clicks of the debrief
# (tests/viewer/debrief.test.mjs, of which the tests have two). Needs chromium.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${BRACHY_BUILD:-build/release}
BRACHY_SESSIONS=all BRACHY_VIEWER=$PWD/$build/viewer BRACHYD=$PWD/$build/bin/brachyd BRACHY=$PWD/$build/bin/brachy \
  BRACHY_ARTEFACTS=$PWD/out/nightly/viewer exec node tests/viewer/debrief.test.mjs
