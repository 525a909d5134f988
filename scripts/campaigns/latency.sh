#!/usr/bin/env bash
# How late brachyd is. First, with the machine to itself: from every pose of a needle that goes in and out to the
# first vertices at a client that follow it; p50 at most one tick and one snapshot, p99 at most 60 ms. Then beside a
# busy loop on every core, with SCHED_FIFO: how late the 200 Hz loop wakes up and what it misses, beside cyclictest's
# threads, one a core, of the same priority and period in the same run; at most 1.5 times as much. Ends with 0 only
# if all of that holds. Needs the right to SCHED_FIFO (root, or rtprio in limits.conf).
#   scripts/campaigns/latency.sh [SECONDS]      default: a minute of load; leave the machine alone meanwhile
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
[[ $# -le 1 && $seconds =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/setup.sh --latency
scripts/build.sh release brachyd brachy
bin=build/release/bin
priority=80
work=$(mktemp -d)
. scripts/daemon.sh
load=()
end_load() { if ((${#load[@]})); then kill "${load[@]}" 2>/dev/null || true; fi; load=(); }
trap 'end_load; kill_daemon; rm -rf "$work"' EXIT

sed -e "s|^fifo_priority = .*|fifo_priority = $priority|" -e 's|^lock_memory = .*|lock_memory = true|' \
  config/prostate.toml >"$work/scene.toml"

echo "latency: 16 s of an insertion, the machine idle"
start_daemon "$work" --config "$work/scene.toml" --port 0
$bin/brachy replay config/insertion.csv --connect "$address" --json >"$work/replay.json"
end_daemon

echo "latency: $seconds s with $(nproc) busy loops, beside cyclictest"
for ((core = 0; core < $(nproc); ++core)); do
  bash -c 'while :; do :; done' &
  load+=($!)
done
stolen_before=$(awk '/^cpu /{print $9}' /proc/stat)
start_daemon "$work" --config "$work/scene.toml" --port 0 --json --duration "$seconds" \
    --trajectory config/insertion.csv --play
cyclictest --quiet --mlockall --smp --priority=$priority --policy=fifo --interval=5000 --duration="$seconds" \
  --histogram=50000 >"$work/cyclictest.txt"
wait "$daemon"
daemon=
end_load
tail -n 1 "$work/daemon.out" >"$work/summary.json"
stolen=$(awk '/^cpu /{print $9}' /proc/stat)
echo "latency: the host took $((10 * (stolen - stolen_before))) ms of the cores meanwhile"
/usr/bin/python3 scripts/campaigns/latency.py "$work/replay.json" "$work/summary.json" "$work/cyclictest.txt"
