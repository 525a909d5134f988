#!/usr/bin/env bash
# Builds and runs the tests.
#   scripts/test.sh          release tests; installs the programs that they run against
#   scripts/test.sh --all    also format, names, layers, the tests under AddressSanitizer and ThreadSanitizer, ten
#                            seconds of each fuzz target, and the charts of `brachy compare --quick`, `brachy
#                            stability --quick`, `brachy zwidth --quick` and scripts/charts/ticks.sh --quick
# BRACHY_DATA_DIR names a folder of shared data; tests that need it say "skipped" without.
set -euo pipefail
cd "$(dirname "$0")/.."

all=0
case "${1:-}" in
  "") ;;
  --all) all=1 ;;
  *) sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2 ;;
esac

run_tests() {  # PRESET "TARGETS" [ctest options]; no targets: all
  local preset=$1 targets=$2; shift 2
  # shellcheck disable=SC2086
  scripts/build.sh "$preset" $targets
  echo "test: $preset"
  ctest --test-dir "build/$preset" --output-on-failure --no-tests=error --output-junit tests.xml "$@"
  scripts/ci/list_skipped.py "build/$preset/tests.xml"
}

if ((all)); then
  scripts/setup.sh --all
  echo "test: format"
  git ls-files '*.h' '*.cpp' | xargs clang-format-14 --dry-run --Werror
  scripts/ci/check_layers.py
  scripts/ci/check_docs.py
fi
scripts/setup.sh --tests
# A build that was configured before these were installed does not know of them yet.
if [[ -f build/release/build.ninja ]]; then cmake --preset release >/dev/null; fi
# Most tests wait for sockets half of their time.
run_tests release '' -j "$((2 * $(nproc)))"
if ((all)); then
  mkdir -p out
  # What only computes, most of the build, is under AddressSanitizer in scripts/campaigns/campaign.sh, and daemon and
  # tools with it: CI has half an hour, and what comes from outside is read in these. The charts take one core:
  # meanwhile the other compiles.
  asan='input_tests realtime_tests haptics_tests net_tests'
  # shellcheck disable=SC2086
  scripts/build.sh asan $asan fuzz_targets >out/asan-build.log 2>&1 &
  compiling=$!
  scripts/charts/compare.sh --quick --charts out/compare-quick
  scripts/charts/ticks.sh --quick --charts out/ticks-quick
  scripts/charts/stability.sh --quick --charts out/stability-quick
  scripts/charts/zwidth.sh --quick --charts out/zwidth-quick
  echo "test: compiling asan"
  wait "$compiling" || { cat out/asan-build.log >&2; exit 1; }
  scripts/campaigns/live_fuzz.sh 5000
  nice -n 19 scripts/campaigns/torn_frames.sh 60 >out/torn-frames.log 2>&1 &
  torn=$!
  nice -n 19 scripts/ci/check_names.py --jobs 1 >out/names.log 2>&1 &
  names=$!
  run_tests asan "$asan" -j 2 -E 'NOT_BUILT|Package'
  scripts/fuzz.sh
  echo "test: torn frames"
  wait "$torn" || { cat out/torn-frames.log >&2; exit 1; }
  tail -n 2 out/torn-frames.log
  # Threads meet in the buffer and in the daemon, which has all of them: these under ThreadSanitizer; server and
  # devices by themselves in the campaign.
  run_tests tsan 'realtime_tests daemon_tests' -j 2 -R 'TripleBuffer|Device|Server|Daemon|Deadline'
  echo "test: names"
  wait "$names" || { cat out/names.log >&2; exit 1; }
  tail -n 1 out/names.log
fi
echo "test: all passed"
