#!/usr/bin/env bash
# Builds brachy_bench and runs it beside the paper's method and the machine's limits; prints the performance goals and
# whether they are met; writes JSON and SVG charts. Wants a quiet machine; takes some 20 minutes, --quick two. Without
# --quick it is the laboratory's long form (apps/lab).
#   scripts/bench.sh [--quick] [--json FILE] [--charts DIR] [--simd TARGET] [Google Benchmark's options]
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/.."

out=out/bench-$(date +%Y%m%d-%H%M%S)-$$
json=$out/bench.json
charts=$out
options=()
while (($#)); do
  case $1 in
    --json | --charts | --simd) (($# > 1)) || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; } ;;&
    --json) json=$(cd "$from" && realpath -m "$2"); shift ;;
    --charts) charts=$(cd "$from" && realpath -m "$2"); shift ;;
    --simd) options+=("--simd=$2"); shift ;;
    --quick | --benchmark_*) options+=("$1") ;;
    *) sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2 ;;
  esac
  shift
done

scripts/setup.sh --charts
targets=(brachy_bench)
if [[ " ${options[*]} " != *' --quick '* ]]; then targets+=(brachy_bench_long); fi
scripts/build.sh release "${targets[@]}"
mkdir -p "$(dirname "$json")" "$charts"
build/release/bin/brachy_bench "${options[@]}" --json="$json"
/usr/bin/python3 scripts/charts/bench_charts.py "$json" "$charts"
echo "bench: figures in $json, charts in $charts"
