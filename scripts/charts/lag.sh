#!/usr/bin/env bash
# How far what ticks show is behind whole ticks of the same poses (`brachy lag`), with one to seventeen needles; and of
# each scenario a running daemon's ticks and missed deadlines beside its idle control thread. Three minutes; keep the
# cores idle. --store: the table in tests/reference/lag becomes that of this run.
#   scripts/charts/lag.sh [--store] [SCENARIO…]
set -euo pipefail
cd "$(dirname "$0")/../.."
store=0 scenarios=()
while (($#)); do
  case $1 in
    --store) store=1 ;;
    -*) sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2 ;;
    *) scenarios+=("$1") ;;
  esac
  shift
done
scripts/build.sh release brachy-study brachyd
out=out/lag
mkdir -p "$out"
options=(--force --daemon-files "$out" --json "$out/lag.json" --markdown "$out/lag.md")
if ((${#scenarios[@]})); then options+=(--scenarios "$(IFS=,; echo "${scenarios[*]}")"); fi
build/release/bin/brachy-study lag "${options[@]}"
rm -f "$out"/*.daemon.json
for scenario in $(sed -n 's/.*"scenario": "\(.*\)".*/\1/p' "$out/lag.json"); do
  build/release/bin/brachyd --config "$out/$scenario.toml" --trajectory "$out/$scenario.csv" --play --port 0 \
    --duration 12 --json --control-thread 2>"$out/$scenario.log" | tail -n 1 >"$out/$scenario.daemon.json"
done
/usr/bin/python3 scripts/charts/lag_table.py "$out" | tee -a "$out/lag.md"
sed -i '1i # Lag of ticks with many needles\n' "$out/lag.md"
if ((store)); then mkdir -p tests/reference/lag; cp "$out/lag.md" "$out/lag.json" tests/reference/lag/; fi
echo "lag: table and figures in $out"
