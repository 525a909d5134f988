#!/usr/bin/env bash
# Times dose on a grid against the exact sum, spacing by spacing, with its errors (brachy_bench's dose rows), and draws
# the chart. Two minutes; wants a quiet machine.
#   scripts/dose.sh [--quick] [--charts DIR] [--json FILE] [--store]
# --store: table and chart in tests/reference/dose, which the README shows, become those of this run.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/.."
usage() { sed -n '2,5s/^# \?//p' "$0" >&2; exit 2; }

charts=out/dose-$(date +%Y%m%d-%H%M%S)-$$
json=
store=
options=()
while (($#)); do
  case $1 in
    --charts | --json) (($# > 1)) || usage ;;&
    --charts) charts=$(cd "$from" && realpath -m "$2"); shift ;;
    --json) json=$(cd "$from" && realpath -m "$2"); shift ;;
    --quick) options+=("$1") ;;
    --store) store=1 ;;
    *) usage ;;
  esac
  shift
done

if [[ $store && ${#options[@]} -gt 0 ]]; then
  echo "dose: --store takes the whole run; leave out --quick" >&2
  exit 2
fi
if [[ $store ]]; then charts=tests/reference/dose; fi
scripts/setup.sh --charts
scripts/build.sh release brachy_bench
mkdir -p "$charts" out
kept=${json:-out/dose.json}
mkdir -p "$(dirname "$kept")"
build/release/bin/brachy_bench "${options[@]}" --benchmark_filter=^dose/ --json="$kept"
/usr/bin/python3 scripts/dose_chart.py "$kept" "$charts"
echo "dose: figures in $kept, table and chart in $charts"
