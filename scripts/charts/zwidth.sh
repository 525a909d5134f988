#!/usr/bin/env bash
# Finds the stiffest spring that a device renders without ringing (`brachy zwidth`) and draws the chart. Seconds.
#   scripts/charts/zwidth.sh [--quick] [--charts DIR] [--json FILE] [--store]
# --store: table and chart in tests/reference/zwidth, which the README shows, become those of this run.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

. scripts/charts/chart_options.sh

scripts/build.sh release brachy-study
build/release/bin/brachy-study zwidth --force "${options[@]}" --json "$kept" --markdown "$charts/zwidth.md"
/usr/bin/python3 scripts/charts/zwidth_chart.py "$kept" "$charts"
echo "zwidth: figures in $kept, table and chart in $charts"
