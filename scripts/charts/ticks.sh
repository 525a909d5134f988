#!/usr/bin/env bash
# Draws the chart that matters: the error of what is shown of motions of 2, 4, 6 and 8 mm, against the tick time of a
# running daemon, for every model; beside them the comparators, which have no daemon. A quarter of an hour on two
# cores, --quick two minutes; leave the cores alone meanwhile.
#   scripts/charts/ticks.sh [--quick] [--charts DIR] [--json FILE] [--store]
# Errors: `brachy ticks`, against tests/reference/large_motion. Ticks: brachyd with one viewer and an idle control
# thread, on config/insertion.csv and while a needle in the gland circles 2, 4, 6 and 8 mm off its path.
# --store: table and chart in tests/reference/ticks, which the README shows, become those of this run, and so does what
# `[model] kernel = "auto"` chooses from (core/scene/choice/comparison.csv); three minutes more.
set -euo pipefail
from=$PWD
cd "$(dirname "$0")/../.."
usage() { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

. scripts/charts/chart_options.sh

scripts/build.sh release brachyd brachy brachy-study
bin=build/release/bin
out=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -rf "$out"' EXIT

rounds=2 circles_s=3
mapfile -t models < <(/usr/bin/python3 scripts/charts/kernel_list.py)
if [[ ${#options[@]} -gt 0 ]]; then  # --quick: one of the ψ kernels
  rounds=1 circles_s=1.5
  mapfile -t models < <(printf '%s\n' "${models[@]}" | grep -Ev '^(psi30|psi32|buhmann)$')
fi

# Straight in along the axis at 49 mm/s, aside, in circles of that radius, back and out.
write_circles() {  # RADIUS_MM
  awk -v radius="$1" -v circles_s="$circles_s" '
    function keyframe(t, x, y, z) { printf "%.6g,1,0,0,%.6g,0,1,0,%.6g,0,0,1,%.6g\n", t, x, y, z }
    BEGIN {
      print "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23"
      keyframe(0, 0, 0, -45); keyframe(1, 0, 0, 4); keyframe(1.05, 0, 0, 4)
      begin = 1.05 + radius / 40
      for (i = 0; i <= 48 * circles_s; ++i) {
        turn = 6.283185307 * i / 48
        keyframe(begin + i / 48, radius * cos(turn), radius * sin(turn), 4)
      }
      end = begin + i / 48
      keyframe(end + radius / 40, 0, 0, 4); keyframe(end + radius / 40 + 0.6, 0, 0, -45)
    }'
}

# Plays a trajectory to a daemon with one viewer and keeps the daemon's closing summary.
play() {  # MODEL TRAJECTORY RUN ROUND
  start_daemon "$out" --config "$out/$1.toml" --port 0 --control-thread --json
  timeout 120 $bin/brachy watch --connect "$address" >"$out/watch.out" 2>&1 &
  local viewer=$!
  timeout 120 $bin/brachy replay "$2" --connect "$address" >"$out/replay.out" 2>&1 \
      || { cat "$out/replay.out" "$out/daemon.log" >&2; exit 1; }
  end_daemon
  wait "$viewer" || true  # the daemon went first
  printf '{"model": "%s", "run": "%s", "round": %d, "summary": %s}\n' "$1" "$3" "$4" \
      "$(tail -n 1 "$out/daemon.out")" >>"$out/runs.json"
}

$bin/brachy-study ticks --force "${options[@]}" --json "$out/errors.json" --markdown "$out/errors.md" >"$out/errors.out"
for radius in 2 4 6 8; do write_circles $radius >"$out/circles_$radius.csv"; done
for model in "${models[@]}"; do printf '[model]\nkernel = "%s"\n' "$model" >"$out/$model.toml"; done
for ((round = 1; round <= rounds; ++round)); do
  for model in "${models[@]}"; do
    echo "ticks: round $round of $rounds, a daemon with $model" >&2
    if [[ ${#options[@]} -eq 0 ]]; then play "$model" config/insertion.csv insertion $round; fi
    for radius in 2 4 6 8; do play "$model" "$out/circles_$radius.csv" "$radius" $round; done
  done
done
/usr/bin/python3 scripts/charts/ticks_chart.py "$out/errors.json" "$out/runs.json" "$kept" "$charts"
if [[ $store ]]; then
  echo "ticks: every setting that auto chooses among" >&2
  $bin/brachy-study ticks --force --choices --json "$out/choices.json" >"$out/choices.out"
  /usr/bin/python3 scripts/charts/ticks_store.py "$out/choices.json" tests/reference/large_motion \
      core/scene/choice/comparison.csv
fi
echo "ticks: figures in $kept, table and chart in $charts"
