#!/usr/bin/env bash
# Builds and runs the tests.
#   scripts/test.sh          release tests of the product; installs the programs that they run against
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

# Runs a command, and notes what it took: seconds of the wall and of processor.
table=
spent=$(mktemp)
trap 'rm -f "$spent"' EXIT
processor_s() {  # of all that has ended, to $processor
  times >"$spent"
  processor=$(awk -F'[ms ]+' 'NR == 2 { printf "%d", 60 * $1 + $2 + 60 * $3 + $4 }' "$spent")
}
stage() {  # NAME COMMAND…
  local name=$1 began=$SECONDS before; shift
  echo "test: $name"
  processor_s
  before=$processor
  "$@"
  processor_s
  table+=$(printf '%-32s %6d %10d' "$name" $((SECONDS - began)) $((processor - before)))$'\n'
}

run_tests() {  # PRESET [ctest options]
  local preset=$1; shift
  rm -rf "build/$preset/test-results"
  ctest --test-dir "build/$preset" --output-on-failure --no-tests=error --output-junit tests.xml "$@"
  scripts/ci/list_skipped.py "build/$preset/tests.xml" "build/$preset/test-results"
}
check_format() { git ls-files '*.h' '*.cpp' | xargs clang-format-14 --dry-run --Werror; }
finish_names() {
  wait "$names" || { cat out/names.log >&2; exit 1; }
  tail -n 1 out/names.log
}
set_up() {
  if ((all)); then scripts/setup.sh --all; else scripts/setup.sh --tests; fi
}
# A build that was configured before these were installed does not know of them yet. The laboratory is nightly's.
build_product() {
  cmake --preset release -DBRACHY_LAB=OFF >/dev/null
  cmake --build --preset release
}

stage packages set_up
if ((all)); then
  stage format check_format
  stage layers scripts/ci/check_layers.py
  stage budget scripts/ci/check_budget.py
  stage shape scripts/ci/check_shape.py
  stage documents scripts/ci/check_docs.py
fi
stage 'release, build' build_product
if ((all)); then
  mkdir -p out
  nice -n 19 scripts/ci/check_names.py --jobs 1 >out/names.log 2>&1 &
  names=$!
fi
# Most tests wait for sockets half of their time.
stage 'release, tests' run_tests release -j "$((2 * $(nproc)))"
if ((all)); then
  # What only computes, most of the build, is under AddressSanitizer in nightly, and daemon and tools with it: what
  # comes from outside is read in these.
  asan=(input_tests realtime_tests haptics_tests net_tests)
  stage 'AddressSanitizer, build' scripts/build.sh asan "${asan[@]}" fuzz_targets
  stage 'live fuzz' scripts/campaigns/live_fuzz.sh 5000
  stage 'AddressSanitizer, tests' run_tests asan -j 3 -E 'NOT_BUILT|Package|Python|Documents|Layers'
  stage fuzz scripts/fuzz.sh
  # Threads meet in the buffer and in the daemon, which has all of them: these under ThreadSanitizer; server and
  # devices by themselves, and long sums, in nightly.
  stage 'ThreadSanitizer, build' scripts/build.sh tsan realtime_tests daemon_tests
  stage 'ThreadSanitizer, tests' run_tests tsan -j 2 \
    -R 'TripleBuffer|Device|Server|Daemon|Deadline|ForceLink|Histogram|MonotonicClock' -E DaemonImplant
  stage 'names, beside the others' finish_names
fi
printf '%-32s %6s %10s\n%s' stage 'wall s' 'processor s' "$table"
echo "test: all passed"
