#!/usr/bin/env bash
# Builds and runs the tests.
#   scripts/test.sh          release tests; installs the programs that they run against
#   scripts/test.sh --all    also format, names, layers, the tests of what reads strangers' bytes under AddressSanitizer
#                            and of buffer and daemon under ThreadSanitizer, ten seconds of each fuzz target and a
#                            short live fuzz; scripts/nightly.sh has the rest
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
  rm -rf "build/$preset/test-results"
  ctest --test-dir "build/$preset" --output-on-failure --no-tests=error --output-junit tests.xml "$@"
  scripts/ci/list_skipped.py "build/$preset/tests.xml" "build/$preset/test-results"
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
  # What only computes, most of the build, is under AddressSanitizer in nightly, and daemon and tools with it: what
  # comes from outside is read in these.
  asan='input_tests realtime_tests haptics_tests net_tests'
  # shellcheck disable=SC2086
  scripts/build.sh asan $asan fuzz_targets
  scripts/campaigns/live_fuzz.sh 5000
  nice -n 19 scripts/ci/check_names.py --jobs 1 >out/names.log 2>&1 &
  names=$!
  run_tests asan "$asan" -j 2 -E 'NOT_BUILT|Package'
  scripts/fuzz.sh
  # Threads meet in the buffer and in the daemon, which has all of them: these under ThreadSanitizer; server and
  # devices by themselves in nightly.
  run_tests tsan 'realtime_tests daemon_tests' -j 2 \
    -R 'TripleBuffer|Device|Server|Daemon|Deadline|ForceLink|Histogram|MonotonicClock'
  echo "test: names"
  wait "$names" || { cat out/names.log >&2; exit 1; }
  tail -n 1 out/names.log
fi
echo "test: all passed"
