#!/usr/bin/env bash
# Runs every model on every reference scene (`brachy compare`) and draws the charts; --quick: the listed models only.
# Under ten minutes on two cores, --quick under two; leave the cores alone meanwhile, times are compared.
#   scripts/charts/compare.sh [--quick] [--charts DIR] [--json FILE] [--references DIR] [--models LIST]
#       [--scenes LIST]
# To renew what the README shows: scripts/charts/compare.sh --charts tests/reference/charts
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

charts=out/compare-$(date +%Y%m%d-%H%M%S)-$$
json=
options=()
while (($#)); do
  case $1 in
    --charts | --json | --references | --models | --scenes) (($# > 1)) || usage ;;&
    --charts) charts=$(cd "$from" && realpath -m "$2"); shift ;;
    --json) json=$(cd "$from" && realpath -m "$2"); shift ;;
    --references) options+=(--references "$(cd "$from" && realpath -m "$2")"); shift ;;
    --models | --scenes) options+=("$1" "$2"); shift ;;
    --quick) options+=("$1") ;;
    *) usage ;;
  esac
  shift
done

scripts/setup.sh --charts
scripts/build.sh release brachy-study
mkdir -p "$charts" out
kept=${json:-out/compare.json}
mkdir -p "$(dirname "$kept")"
build/release/bin/brachy-study compare --force "${options[@]}" --json "$kept" --markdown "$charts/compare.md"
/usr/bin/python3 scripts/charts/compare_charts.py "$kept" "$charts"
echo "compare: figures in $kept, table and charts in $charts"
