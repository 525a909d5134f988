#!/usr/bin/env bash
# Sweeps every method to failure (`brachy stability`) and draws the charts; --quick: smaller cases.
# About a minute and a half on two cores, --quick some ten seconds.
#   scripts/charts/stability.sh [--quick] [--charts DIR] [--json FILE] [--scene FILE] [--store]
# --store: table and charts in tests/reference/stability, which the README shows, become those of this run.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

charts=out/stability-$(date +%Y%m%d-%H%M%S)-$$
json=
store=
quick=
options=()
while (($#)); do
  case $1 in
    --charts | --json | --scene) (($# > 1)) || usage ;;&
    --charts) charts=$(cd "$from" && realpath -m "$2"); shift ;;
    --json) json=$(cd "$from" && realpath -m "$2"); shift ;;
    --scene) options+=(--scene "$(cd "$from" && realpath -m "$2")"); shift ;;
    --quick) options+=("$1"); quick=1 ;;
    --store) store=1 ;;
    *) usage ;;
  esac
  shift
done

if [[ $store && ($quick || ${#options[@]} -gt 0) ]]; then
  echo "stability: --store takes the whole run on the default scene; leave out --quick and --scene" >&2
  exit 2
fi
if [[ $store ]]; then charts=tests/reference/stability; fi
scripts/setup.sh --charts
scripts/build.sh release brachy-study
mkdir -p "$charts" out
kept=${json:-out/stability.json}
mkdir -p "$(dirname "$kept")"
build/release/bin/brachy-study stability --force "${options[@]}" --json "$kept" --out out/stability
cp out/stability/stability.md "$charts/"
/usr/bin/python3 scripts/charts/stability_charts.py "$kept" "$charts"
echo "stability: figures in $kept, table and charts in $charts"
