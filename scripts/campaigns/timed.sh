#!/usr/bin/env bash
# What must be quick: small files that ask for much work, the fit of a kernel, the first paint of the viewer's page.
# Runs the tests that have such a limit with the limit, one at a time; leave the machine alone for a minute. Ends with 0
# only where each is kept.
#   scripts/campaigns/timed.sh
set -euo pipefail
cd "$(dirname "$0")/../.."
[[ $# -eq 0 ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/build.sh release
BRACHY_TIMED=1 ctest --test-dir build/release --output-on-failure --no-tests=error \
    -R '^(MeshBombs|CompactFit|Viewer\.ShowsTheRunningDaemonInABrowser)$'
