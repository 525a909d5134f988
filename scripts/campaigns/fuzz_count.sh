#!/usr/bin/env bash
# Fuzzes targets by turns until they have run so many inputs together without a finding; what earlier runs of this
# build folder counted is in it. Exits with 1 at the first finding, and names it.
#   scripts/campaigns/fuzz_count.sh [--executions N] [--slice SECONDS] [--jobs 1|2] [--most SECONDS] [TARGET…]
#     N: 10,000,000; a slice of each target in turn: 60 s; --most: after the first slices, stop after so long, with 3
#     where N is not reached; run it again to go on
#     TARGET: as of scripts/fuzz.sh; by default what `brachy import` reads
set -euo pipefail
cd "$(dirname "$0")/../.."
executions=10000000 slice=60 jobs=2 most=0 targets=()
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
while (($#)); do
  case $1 in
    --executions) executions=${2:-}; shift ;;
    --slice) slice=${2:-}; shift ;;
    --jobs) jobs=${2:-}; shift ;;
    --most) most=${2:-}; shift ;;
    -*) usage ;;
    *) targets+=("$1") ;;
  esac
  shift
done
[[ $executions =~ ^[1-9][0-9]*$ && $slice =~ ^[1-9][0-9]*$ && $most =~ ^[0-9]+$ ]] || usage
((${#targets[@]})) || targets=(label_nrrd label_nifti label_meta rt_structure rt_plan rt_dose)

counts=build/asan/fuzz/executions
mkdir -p "${counts%/*}"
touch $counts
of() { awk -v t="$1" '$1 == t { n += $2; s += $3 } END { print n + 0, s + 0 }' $counts; }  # TARGET: executions, seconds
show() {
  local n s total=0
  printf '%-14s %12s %9s\n' target executions per_s
  for target in "${targets[@]}"; do
    read -r n s < <(of "$target")
    printf '%-14s %12d %9d\n' "$target" "$n" $((s ? n / s : 0))
    total=$((total + n))
  done
  printf '%-14s %12d of %d\n' total $total "$executions"
  ((total >= executions))
}

ran=0
until show; do
  if ((most && ran && SECONDS >= most)); then echo "fuzz count: not reached in $most s"; exit 3; fi
  ran=1 status=0
  scripts/fuzz.sh --seconds "$slice" --jobs "$jobs" "${targets[@]}" >build/asan/fuzz/last_slice 2>&1 || status=$?
  if ((status)); then
    cat build/asan/fuzz/last_slice
    exit $status
  fi
  for target in "${targets[@]}"; do
    awk -v t="$target" -v s="$slice" '$1 == t && $2 ~ /^[0-9]+$/ { print t, $2, s }' \
      build/asan/fuzz/last_slice >>$counts
  done
done
