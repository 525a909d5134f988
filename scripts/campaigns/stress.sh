#!/usr/bin/env bash
# The running daemon where its methods fail: a needle that sweeps through the gland at 28 cm/s in all directions,
# teleports, shakes at the capsule and is driven onto anchors, played over TCP. Ends with 0 only if every tick and every
# frame is injective or flagged, nothing is not finite, and no burst of deadlines was missed.
#   scripts/campaigns/stress.sh [SECONDS]      default: 60; leave both cores alone meanwhile
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
[[ $# -le 1 && $seconds =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/build.sh release brachyd brachy
bin=build/release/bin
work=$(mktemp -d)
. scripts/daemon.sh
watcher=
stop_all() { if [[ $watcher ]]; then kill "$watcher" 2>/dev/null || true; fi; kill_daemon; }
trap stop_all EXIT

# Without clearance no anchor steps out of the needle's way.
cat >"$work/scene.toml" <<'SCENE'
name = "stress"
[anchors]
clearance_mm = 0
[server]
port = 0
SCENE
$bin/brachy inspect "$work/scene.toml" --out "$work/surface.ply" --json >"$work/inspect.json"
/usr/bin/python3 scripts/campaigns/stress.py trajectory "$seconds" "$work/inspect.json" "$work/surface.ply" \
    >"$work/trajectory.csv"

start_daemon "$work" --config "$work/scene.toml" --control-thread --json
echo "stress: $seconds s on $address"
$bin/brachy watch --connect "$address" --json >"$work/watch.json" 2>"$work/watch.log" &
watcher=$!
$bin/brachy replay "$work/trajectory.csv" --connect "$address" --json >"$work/replay.json"

kill -INT $watcher
wait $watcher
watcher=
end_daemon

status=0
/usr/bin/python3 scripts/campaigns/stress.py judge "$seconds" "$work/daemon.out" "$work/watch.json" \
    "$work/replay.json" || status=$?
if ((status)); then echo "stress: scene, trajectory, logs and reports lie in $work"; else rm -r "$work"; fi
exit $status
