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
trap 'rm -f "$spent"; end_beside' EXIT
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
  BRACHY_TEST_RUN=$$ ctest --test-dir "build/$preset" --output-on-failure --no-tests=error --output-junit tests.xml "$@"
  scripts/ci/list_skipped.py "build/$preset/tests.xml" "build/$preset/test-results"
  end_left_behind
}
# What a test leaves running takes the time of all that follows: it is ended, and the run fails.
end_left_behind() {
  local left='' try pid
  for try in {1..20}; do  # some end a moment after the test that they served
    left=$(grep -lsz "^BRACHY_TEST_RUN=$$\$" /proc/[0-9]*/environ | cut -d / -f 3 || true)
    if [[ ! $left ]]; then return; fi
    sleep 0.5
  done
  for pid in $left; do
    echo "test: left running by a test: $pid, $(tr '\0' ' ' <"/proc/$pid/cmdline" | cut -c 1-200)" >&2
    kill -KILL "$pid" || true
  done
  exit 1
}
check_format() { git ls-files '*.h' '*.cpp' | xargs clang-format-14 --dry-run --Werror; }
# NAME COMMAND… on the time that other stages leave, after what began so before it; finish NAME waits for it. Where
# Linux groups processes by session (autogroup), nice counts only within one: the group is made nice too.
declare -A beside
last_beside=
begin_beside() {
  local name=$1 before=$last_beside; shift
  (
    if [[ $before ]]; then while kill -0 "$before" 2>/dev/null; do sleep 0.5; done; fi
    exec setsid nice -n 19 bash -c '{ echo 19 >/proc/self/autogroup; } 2>/dev/null || true; exec "$@"' bash "$@"
  ) >"out/$name.log" 2>&1 &
  beside[$name]=$!
  last_beside=$!
}
# With nothing left to run beside, it has the same right to the cores as any other program of the machine.
finish() {
  { echo 0 >"/proc/${beside[$1]}/autogroup" && renice -n 0 -g "${beside[$1]}"; } >/dev/null 2>&1 || true
  wait "${beside[$1]}" || { cat "out/$1.log" >&2; exit 1; }
  tail -n 1 "out/$1.log"
  unset "beside[$1]"
}
end_beside() {  # of a run that failed: the process, and the group that it became
  local pid
  for pid in "${beside[@]}"; do kill -- "$pid" "-$pid" 2>/dev/null || true; done
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
  # What only computes, most of the build, is under AddressSanitizer in nightly, and daemon and tools with it: what
  # comes from outside is read in these. Threads meet in the buffer and in the daemon, which has all of them: these
  # under ThreadSanitizer; server and devices by themselves, and long sums, in nightly.
  asan=(input_tests realtime_tests haptics_tests net_tests)
  begin_beside names scripts/ci/check_names.py --jobs 1
  begin_beside asan scripts/build.sh asan "${asan[@]}" fuzz_targets
  begin_beside tsan scripts/build.sh tsan realtime_tests daemon_tests
fi
# Most tests wait for sockets half of their time.
stage 'release, tests' run_tests release -j "$((2 * $(nproc)))"
if ((all)); then
  stage 'names, beside the tests' finish names
  stage 'AddressSanitizer, build' finish asan
  stage 'live fuzz' scripts/campaigns/live_fuzz.sh 5000
  stage 'AddressSanitizer, tests' run_tests asan -j 3 -E 'NOT_BUILT|Package|Python|Documents|Layers'
  stage fuzz scripts/fuzz.sh
  stage 'ThreadSanitizer, build' finish tsan
  stage 'ThreadSanitizer, tests' run_tests tsan -j 2 \
    -R 'TripleBuffer|Device|Server|Daemon|Deadline|ForceLink|Histogram|MonotonicClock' -E DaemonImplant
fi
printf '%-32s %6s %10s\n%s' stage 'wall s' 'processor s' "$table"
echo "test: all passed"
