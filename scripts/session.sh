#!/usr/bin/env bash
# A whole implant, by a script instead of a hand: the plan's needles go in one after the other through the template,
# leave their seeds as they are drawn back, and the session ends with its score. Installs and builds what is missing.
#   scripts/session.sh [--offline] [SCENE.toml]     the scene needs a plan; default: config/session.toml
#     --offline: the same simulation without daemon and clock, in a few seconds instead of a minute
set -euo pipefail
cd "$(dirname "$0")/.."
offline=0
if [[ ${1:-} == --offline ]]; then offline=1; shift; fi
[[ $# -le 1 && ${1:-} != -* ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
scene=${1:-config/session.toml}
speed=2  # needles at 100 mm/s in, 40 mm/s out

scripts/build.sh release brachyd brachy
bin=build/release/bin
out=out/session-$(date +%Y%m%d-%H%M%S)-$$
mkdir -p "$out"
echo "session: the plan of $scene"
$bin/brachy plan --force --config "$scene" --trajectory "$out/needles.csv" >"$out/plan.txt"
head -3 "$out/plan.txt"

if ((offline)); then
  echo "session: stepping"
  $bin/brachy replay "$out/needles.csv" --offline --config "$scene" --session "$out/session"
  exit
fi

. scripts/daemon.sh
start_daemon "$out" --config "$scene" --port 0 --control-thread --session "$out/session"
seconds=$(tail -n 1 "$out/needles.csv" | awk -F, -v s=$speed '{print int($1 / s)}')
echo "session: daemon on $address; $seconds s of needles"
$bin/brachy watch --connect "$address" >"$out/watch.log" &
watcher=$!
tail -n +1 -f --pid=$watcher "$out/watch.log" 2>/dev/null | grep --line-buffered -E '^  tick [0-9]+: .*seed' &
$bin/brachy replay "$out/needles.csv" --connect "$address" --speed $speed >"$out/replay.log"
kill -INT $watcher && wait $watcher || true
end_daemon
echo
cat "$out/replay.log"
sed -n '/^brachyd:/,$p' "$out/daemon.log"
