#!/usr/bin/env bash
# Shows the whole system at work, once, and ends by itself: the daemon deforms the default prostate while a scripted
# needle is driven in and out over TCP; one client watches, one records. Then leaves a daemon to look at in a
# browser, for ten minutes, and prints its link. Installs and builds what is missing.
#   scripts/run.sh [--no-viewer] [TRAJECTORY.csv] [SCENE.toml]      default: one insertion; to look at: a whole implant
set -euo pipefail
cd "$(dirname "$0")/.."
shows=1
if [[ ${1:-} == --no-viewer ]]; then shows=0; shift; fi
[[ $# -le 2 && ${1:-} != -* ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
trajectory=${1:-config/insertion.csv}
scene=${2:-config/prostate.toml}

# The demonstration needs the programs alone. npm is installed while they compile, as apt waits for the network, and the
# page is built while the needle goes in.
scripts/setup.sh
out=out/run-$(date +%Y%m%d-%H%M%S)-$$
mkdir -p "$out"
if ((shows)); then
  scripts/setup.sh --viewer >"$out/setup.log" 2>&1 &
  installing=$!
fi
scripts/build.sh release brachyd brachy
if ((shows)); then
  wait "$installing" || { cat "$out/setup.log" >&2; exit 1; }
  nice -n 19 scripts/build.sh release viewer >"$out/viewer_build.log" 2>&1 &
  building=$!
fi
bin=build/release/bin

. scripts/daemon.sh
clients=()
stop_all() { for pid in "${clients[@]}"; do kill "$pid" 2>/dev/null || true; done; kill_daemon; }
trap stop_all EXIT

echo "run: starting the daemon with $scene"
start_daemon "$out" --config "$scene" --port 0 --control-thread

echo "run: daemon on $address; a client watches, one records, the needle goes in"
$bin/brachy watch --connect "$address" >"$out/watch.log" &
watcher=$!
$bin/brachy record --connect "$address" --surface --out "$out/recording.brachy" >"$out/record.log" 2>"$out/record.err" &
recorder=$!
clients=($watcher $recorder)
tail -n +1 -f --pid=$watcher "$out/watch.log" 2>/dev/null | grep --line-buffered -E '^t |^  tick [0-9]+:' &
$bin/brachy replay "$trajectory" --connect "$address" >"$out/replay.log"

# SIGINT asks the clients for their last words, then SIGTERM the daemon for its own.
kill -INT $watcher $recorder
wait $watcher $recorder || true
clients=()
end_daemon
if ((shows)); then
  wait "$building" || { cat "$out/viewer_build.log" >&2; exit 1; }
  grep '^viewer: ' "$out/viewer_build.log" || true
fi

echo
echo "=== Summary ==="
cat "$out/replay.log"
grep -vE '^t |^  tick [0-9]+:' "$out/watch.log" || true
grep -A20 '^brachyd:' "$out/daemon.log"
cat "$out/record.log"
echo "run: everything lies in $out; for ParaView: $bin/brachy export $out/recording.brachy --out $out/paraview"
if ((!shows)); then exit; fi

if (($#)); then
  shown=(--config "$scene" --trajectory "$trajectory")
else
  $bin/brachy plan --force --config config/session.toml --trajectory "$out/implant.csv" >"$out/plan.txt"
  shown=(--config config/session.toml --trajectory "$out/implant.csv")
fi
setsid "$bin/brachyd" "${shown[@]}" --play --port 0 --http-port 0 --duration 600 \
  >"$out/viewer.out" 2>"$out/viewer.log" </dev/null &
viewer=$!
until grep -qs '^http on ' "$out/viewer.out"; do
  kill -0 "$viewer" 2>/dev/null || { cat "$out/viewer.log" >&2; exit 1; }
  sleep 0.05
done
echo "run: see it move: http://$(sed -n 's/^http on //p' "$out/viewer.out")   (for ten minutes; kill $viewer ends it)"
