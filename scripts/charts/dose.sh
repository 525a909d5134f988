#!/usr/bin/env bash
# Times dose on a grid against the exact sum, spacing by spacing, with its errors (brachy_bench's dose rows), and draws
# the chart. Two minutes; wants a quiet machine.
#   scripts/charts/dose.sh [--quick] [--charts DIR] [--json FILE] [--store]
# --store: table and chart in tests/reference/dose, which the README shows, become those of this run.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

. scripts/charts/chart_options.sh

targets=(brachy_bench)
if [[ " ${options[*]} " != *' --quick '* ]]; then targets+=(brachy_bench_long); fi
scripts/build.sh release "${targets[@]}"
build/release/bin/brachy_bench "${options[@]}" --benchmark_filter=^dose/ --json="$kept"
/usr/bin/python3 scripts/charts/dose_chart.py "$kept" "$charts"
echo "dose: figures in $kept, table and chart in $charts"
