#!/usr/bin/env bash
# Whether brachyd stays as it is: a device that puts its needle in and out and is killed now and then, three viewers
# that stay, and clients that come, break the rules, stop reading and vanish, round by round; between two rounds,
# with nobody else there, memory and descriptors are read. Ends with a chart and 0 only if the memory and the
# descriptors stayed, no viewer missed anything, and the daemon ended as it should.
#   scripts/campaigns/soak.sh [--short | --seconds N] [--charts DIR]      default: 8 hours; --short: 10 minutes;
#       charts in out/soak
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=28800
charts=out/soak
while (($#)); do
  case $1 in
    --short) seconds=600; shift ;;
    --seconds) seconds=${2:-}; shift 2 || true ;;
    --charts) charts=${2:-}; shift 2 || true ;;
    *) seconds=; break ;;
  esac
done
[[ $seconds =~ ^[1-9][0-9]*$ && $charts ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/setup.sh --charts
scripts/build.sh release brachyd brachy
work=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -rf "$work"' EXIT
start_daemon "$work" --config config/prostate.toml --port 0 --http-port 0 --igtl-port 0 --json --report-every 10
mkdir -p "$charts"
status=0
/usr/bin/python3 scripts/campaigns/soak.py run "$work/daemon.out" "$daemon" "$seconds" "$work" "$charts/soak.csv" \
    || status=$?
pid=$daemon
daemon=
kill -TERM "$pid" 2>/dev/null || true
wait "$pid" || { echo "soak: brachyd ended with $?:" >&2; tail -n 20 "$work/daemon.log" >&2; status=1; }
/usr/bin/python3 scripts/campaigns/soak.py judge "$seconds" "$charts/soak.csv" "$work/daemon.out" \
    "$charts/soak.svg" || status=1
exit $status
