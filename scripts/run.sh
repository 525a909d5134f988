#!/usr/bin/env bash
# Shows the whole system at work, once, and ends by itself: the daemon deforms the default prostate while a scripted
# needle is driven in and out over TCP; one client watches, one records. Installs and builds what is missing.
#   scripts/run.sh [TRAJECTORY.csv] [SCENE.toml]
set -euo pipefail
cd "$(dirname "$0")/.."
trajectory=${1:-config/insertion.csv}
scene=${2:-config/prostate.toml}

scripts/build.sh release brachyd brachy
bin=build/release/bin
out=out/run-$(date +%Y%m%d-%H%M%S)-$$
mkdir -p "$out"

. scripts/daemon.sh
clients=()
stop_all() { for pid in "${clients[@]}"; do kill "$pid" 2>/dev/null || true; done; kill_daemon; }
trap stop_all EXIT

echo "run: starting the daemon with $scene"
start_daemon "$out" --config "$scene" --port 0 --control-thread

echo "run: daemon on $address; a viewer watches, a recorder writes, the needle goes in"
$bin/brachy watch --connect "$address" >"$out/watch.log" &
watcher=$!
$bin/brachy record --connect "$address" --surface --out "$out/recording" >"$out/record.log" &
recorder=$!
clients=($watcher $recorder)
tail -n +1 -f --pid=$watcher "$out/watch.log" 2>/dev/null | grep --line-buffered -E '^t |^  tick [0-9]+:' &
$bin/brachy replay "$trajectory" --connect "$address" >"$out/replay.log"

# SIGINT asks the clients for their last words, then SIGTERM the daemon for its own.
kill -INT $watcher $recorder
wait $watcher $recorder || true
clients=()
end_daemon

echo
echo "=== Summary ==="
cat "$out/replay.log"
grep -vE '^t |^  tick [0-9]+:' "$out/watch.log" || true
grep -A20 '^brachyd:' "$out/daemon.log"
cat "$out/record.log"
echo "run: everything lies in $out; look at it with: paraview $out/recording/recording.pvd"
