#!/usr/bin/env bash
# What goes wrong, to the running programs over real sockets, and what it costs those that did nothing wrong: slow,
# stopped, half-open and lying peers, too many of them, a server that is stopped, killed, or has no descriptors or
# disk left. Ends with a table of case, figure, limit and verdict; 0 only where every limit is kept.
#   scripts/campaigns/faults.sh [--short] [--sanitized] [--json FILE] [CASE…]      all cases; leave both cores alone
#       for half an hour, --short four minutes
#     --sanitized: the programs are those of AddressSanitizer and UBSan; only what they find is judged, no figure
#     cases: viewers limit half-open lies flood attack hand requests stop descriptors disk load relay kill kills spoilt
#       sigterm start-stop
set -euo pipefail
cd "$(dirname "$0")/../.."
[[ ${1:-} != -h && ${1:-} != --help ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0"; exit 0; }
preset=release
for option in "$@"; do
  if [[ $option == --sanitized ]]; then
    preset=asan
    export BRACHY_SANITIZED=1
  fi
done
scripts/build.sh $preset brachyd brachy brachy_crowd
exec /usr/bin/python3 scripts/campaigns/faults/main.py "$@"
