#!/usr/bin/env bash
# People at the viewer, scripted, in chromium (tests/viewer); the tests have two of each.
#   browser.sh teacher    finds the mistake of each of ten recorded sessions within three clicks of the debrief
#   browser.sh trainee [keys|mouse|touch]    passes exercises by it, or each by another, and fails them by a planted
#                                            mistake
#   browser.sh whole [keys|mouse|touch]      the same of whole implants and a whole fraction
set -euo pipefail
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
cd "$(dirname "$0")/../.."
build=${BRACHY_BUILD:-build/release}
export BRACHY_VIEWER=$PWD/$build/viewer BRACHYD=$PWD/$build/bin/brachyd BRACHY=$PWD/$build/bin/brachy
export BRACHY_ARTEFACTS=$PWD/out/nightly/viewer${2:+-$2}
case "${2:-}" in
  '') ;;
  keys | mouse | touch) export BRACHY_WAYS=$2 ;;
  *) usage ;;
esac
case "${1:-}" in
  teacher) BRACHY_SESSIONS=all exec node tests/viewer/debrief.test.mjs ;;
  trainee) BRACHY_EXERCISES=01,02,03,04,05,06,07,08,12,14 exec node tests/viewer/exercises.test.mjs ;;
  whole) BRACHY_EXERCISES=09,10,13 exec node tests/viewer/exercises.test.mjs ;;
  *) usage ;;
esac
