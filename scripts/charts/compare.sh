#!/usr/bin/env bash
# Runs every model on every reference scene (`brachy compare`) and draws the charts; --quick: the listed models only.
# Under ten minutes on two cores, --quick under two; leave the cores alone meanwhile, times are compared.
#   scripts/charts/compare.sh [--quick] [--charts DIR] [--json FILE] [--store] [--references DIR] [--models LIST]
#       [--scenes LIST]
# --store: what `[model] kernel = "auto"` chooses from (core/scene/choice/comparison.csv) becomes what was measured now.
# To renew what the README shows: scripts/charts/compare.sh --charts tests/reference/charts --store
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

charts=out/compare-$(date +%Y%m%d-%H%M%S)-$$
json=
store=
quick=
options=()
while (($#)); do
  case $1 in
    --charts | --json | --references | --models | --scenes) (($# > 1)) || usage ;;&
    --charts) charts=$(cd "$from" && realpath -m "$2"); shift ;;
    --json) json=$(cd "$from" && realpath -m "$2"); shift ;;
    --references) options+=(--references "$(cd "$from" && realpath -m "$2")"); shift ;;
    --models | --scenes) options+=("$1" "$2"); shift ;;
    --quick) options+=("$1"); quick=1 ;;
    --store) store=1 ;;
    *) usage ;;
  esac
  shift
done

if [[ $store && $quick ]]; then echo "compare: --store takes every row; leave out --quick" >&2; exit 2; fi
scripts/setup.sh --charts
scripts/build.sh release brachy-study
mkdir -p "$charts" out
kept=${json:-out/compare.json}
mkdir -p "$(dirname "$kept")"
build/release/bin/brachy-study compare "${options[@]}" --json "$kept" --markdown "$charts/compare.md"
/usr/bin/python3 scripts/charts/compare_charts.py "$kept" "$charts"
if [[ $store ]]; then
  /usr/bin/python3 scripts/charts/compare_store.py "$kept" tests/reference core/scene/choice/comparison.csv
fi
echo "compare: figures in $kept, table and charts in $charts"
