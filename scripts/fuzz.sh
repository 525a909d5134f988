#!/usr/bin/env bash
# Fuzzes every decoder of what comes from outside, two at a time unless --jobs says one, under AddressSanitizer and
# UndefinedBehaviorSanitizer. Ends with 1 if an input was found that crashes, hangs, leaks, or breaks what a target
# says must hold.
#   scripts/fuzz.sh [--seconds N | --short | --long] [--jobs 1|2] [--keep] [TARGET…]
#     seconds for each target: 10, --short 60, --long 3600; TARGET: a TARGET_fuzz.cpp of tests/fuzz or
#     tests/apps/lab/fuzz, by default all
#     --keep: inputs that reach what no kept one does join tests/fuzz/corpus
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=10 jobs=2 keep=0 targets=()
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
while (($#)); do
  case $1 in
    --seconds) seconds=${2:-}; shift ;;
    --short) seconds=60 ;;
    --long) seconds=3600 ;;
    --jobs) jobs=${2:-}; shift ;;
    --keep) keep=1 ;;
    -*) usage ;;
    *) [[ -f tests/fuzz/$1_fuzz.cpp || -f tests/apps/lab/fuzz/$1_fuzz.cpp ]] \
         || { echo "fuzz: there is no tests/fuzz/$1_fuzz.cpp" >&2; exit 2; }
       targets+=("$1") ;;
  esac
  shift
done
[[ $seconds =~ ^[1-9][0-9]*$ && $jobs =~ ^[12]$ ]] || usage
if ((${#targets[@]} == 0)); then
  for file in tests/fuzz/*_fuzz.cpp tests/apps/lab/fuzz/*_fuzz.cpp; do
    file=${file##*/}; targets+=("${file%_fuzz.cpp}")
  done
fi

scripts/build.sh asan "${targets[@]/%/_fuzz}"
work=build/asan/fuzz
mkdir -p $work/log $work/findings
rm -f $work/log/*

dictionary() {  # TARGET
  case $1 in
    http*) echo http ;;
    igtl*) echo igtl ;;
    scene | plan | source) echo toml ;;
    trajectory | tables | beads | session) echo csv ;;
    mesh) echo mesh ;;
    nrrd | label_nrrd) echo nrrd ;;
    label_nifti) echo nifti ;;
    label_meta) echo meta ;;
    rt_*) echo dicom ;;
    *) echo wire ;;
  esac
}

fuzz() {  # TARGET, in a shell of its own, which it becomes; its files go to memory
  local corpus=$work/corpus/$1
  mkdir -p "$corpus"
  # Few frames of each allocation, and a small quarantine: an execution is allocations above all.
  export TMPDIR=/dev/shm ASAN_OPTIONS=allow_addr2line=1:malloc_context_size=6:quarantine_size_mb=32
  export UBSAN_OPTIONS=print_stacktrace=1:allow_addr2line=1
  export LSAN_OPTIONS=suppressions=tests/fuzz/leaks.supp:print_suppressions=0
  exec build/asan/bin/"$1_fuzz" -max_total_time="$seconds" -timeout=20 \
    -rss_limit_mb=1024 -malloc_limit_mb=256 -print_final_stats=1 \
        -dict=tests/fuzz/dictionaries/"$(dictionary "$1")".dict \
    -artifact_prefix=$work/findings/"$1"- "$corpus" tests/fuzz/corpus/"$1" >$work/log/"$1" 2>&1
}

running=()
end_all() { if ((${#running[@]})); then kill "${running[@]}" 2>/dev/null || true; fi; }
trap end_all EXIT
finish_one() {
  local pid i
  wait -n -p pid "${running[@]}" || true  # judged by what it leaves
  for i in "${!running[@]}"; do [[ ${running[i]} != "$pid" ]] || unset "running[$i]"; done
  running=("${running[@]}")
}

echo "fuzz: ${#targets[@]} targets, $seconds s each, $jobs at a time"
begin=$SECONDS
for i in "${!targets[@]}"; do
  if ((${#running[@]} == jobs)); then finish_one; fi
  printf 'fuzz: %4d s, %d of %d: %s\n' $((SECONDS - begin)) $((i + 1)) ${#targets[@]} "${targets[i]}"
  fuzz "${targets[i]}" &
  running+=($!)
done
while ((${#running[@]})); do finish_one; done

of() { grep -oP "$2" $work/log/"$1" | tail -n 1 || true; }  # TARGET PATTERN: what stands behind \K, the last one
status=0
printf '%-16s %12s %10s %9s %9s\n' target executions coverage corpus findings
for target in "${targets[@]}"; do
  executions=$(of "$target" 'stat::number_of_executed_units: \K\d+')
  findings=0
  # A target without its last figures was not judged, whatever the reason.
  if [[ $(of "$target" 'Test unit written to \K.*') || ! $executions ]]; then findings=1 status=1; fi
  printf '%-16s %12s %10s %9s %9s\n' "$target" "${executions:--}" "$(of "$target" 'cov: \K\d+')" \
    "$(of "$target" 'corp: \K\d+')" $findings
done
for target in "${targets[@]}"; do
  finding=$(of "$target" 'Test unit written to \K.*')
  if [[ $finding ]]; then
    echo
    grep -m 1 -A 12 -E 'ERROR: |runtime error: |Failure$' $work/log/"$target" || true
    echo "fuzz: $target: found $finding; again: build/asan/bin/${target}_fuzz $finding"
  elif [[ ! $(of "$target" 'stat::number_of_executed_units: \K\d+') ]]; then
    echo
    tail -n 5 $work/log/"$target"
    echo "fuzz: $target ended before its time; all it said is in $work/log/$target"
  elif ((keep)); then
    mkdir -p tests/fuzz/corpus/"$target"
    # Few and small: one for each edge that no other reaches, and nothing long.
    build/asan/bin/"${target}_fuzz" -set_cover_merge=1 -use_counters=0 -max_len=400 tests/fuzz/corpus/"$target" \
        $work/corpus/"$target" \
      >$work/log/"$target"-merge 2>&1
  fi
done
exit $status
