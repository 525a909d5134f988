#!/usr/bin/env bash
# What goes wrong, to the running programs over real sockets, and what it costs those that did nothing wrong: slow,
# stopped, half-open and lying peers, too many of them, a server that is stopped, killed, or has no descriptors or
# disk left. Ends with a table of case, figure, limit and verdict; 0 only where every limit is kept.
#   scripts/campaigns/faults.sh [--short] [--json FILE] [CASE…]      all cases; leave both cores alone for ten
#       minutes, --short two
#     cases: viewers limit half-open lies flood attack hand stop descriptors disk kill sigterm start-stop
set -euo pipefail
cd "$(dirname "$0")/../.."
[[ ${1:-} != -h && ${1:-} != --help ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0"; exit 0; }
scripts/build.sh release brachyd brachy brachy_crowd
exec /usr/bin/python3 scripts/campaigns/faults/main.py "$@"
