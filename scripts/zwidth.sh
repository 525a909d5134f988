#!/usr/bin/env bash
# Finds the stiffest spring that a device renders without ringing (`brachy zwidth`) and draws the chart. Seconds.
#   scripts/zwidth.sh [--quick] [--charts DIR] [--json FILE] [--store]
# --store: table and chart in tests/reference/zwidth, which the README shows, become those of this run.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/.."
usage() { sed -n '2,4s/^# \?//p' "$0" >&2; exit 2; }

charts=out/zwidth-$(date +%Y%m%d-%H%M%S)-$$
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
  echo "zwidth: --store takes the whole run; leave out --quick" >&2
  exit 2
fi
if [[ $store ]]; then charts=tests/reference/zwidth; fi
scripts/setup.sh --charts
scripts/build.sh release brachy
mkdir -p "$charts" out
kept=${json:-out/zwidth.json}
mkdir -p "$(dirname "$kept")"
build/release/bin/brachy zwidth "${options[@]}" --json "$kept" --markdown "$charts/zwidth.md"
/usr/bin/python3 scripts/zwidth_chart.py "$kept" "$charts"
echo "zwidth: figures in $kept, table and chart in $charts"
