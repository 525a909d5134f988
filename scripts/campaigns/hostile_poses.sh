#!/usr/bin/env bash
# Hands that stir, twist and teleport 1, 4 and 16 needles in the running daemon, by random scripts of 10 s over TCP.
# Prints what a tick takes and ends with 0 only if every tick is certified or flagged and finite, its p99 within 0.8 of
# the period, and no more deadlines are missed than the idle control thread's and 0.5 %.
#   scripts/campaigns/hostile_poses.sh [SCRIPTS [FIRST]]
#                        default: 12 from 0 on; all 1,000 take 3 h, in one part or several (300 300: the second three
#                        hundred). Leave both cores alone meanwhile
#   scripts/campaigns/hostile_poses.sh --offline [SCRIPTS]
#                        by the simulator alone, on all cores, without the time: 1,000 take 40 min on two
set -euo pipefail
cd "$(dirname "$0")/../.."
mode=daemon
[[ ${1:-} != --offline ]] || { mode=offline; shift; }
scripts=${1:-12}
first=${2:-0}
most=2
[[ $mode == daemon ]] || most=1
if ! [[ $# -le $most && $scripts =~ ^[1-9][0-9]*$ && $first =~ ^[0-9]+$ ]]; then
  sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2
  exit 2
fi

scripts/build.sh release brachyd brachy
player=scripts/campaigns/hostile_poses.py
[[ $mode == daemon ]] || exec /usr/bin/python3 $player offline "$scripts" build/release/bin/brachy
work=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -r "$work"' EXIT

status=0
for needles in 1 4 16; do
  /usr/bin/python3 $player scene "$needles" >"$work/scene.toml"
  start_daemon "$work" --config "$work/scene.toml" --port 0 --control-thread --json
  for ((script = first / 3; script < first / 3 + (scripts + 2) / 3; ++script)); do
    /usr/bin/python3 $player trajectory "$needles" "$script" >"$work/trajectory.csv"
    build/release/bin/brachy replay "$work/trajectory.csv" --connect "$address" --json >/dev/null
  done
  end_daemon
  /usr/bin/python3 $player judge "$needles" "$work/daemon.out" || status=1
done
exit $status
