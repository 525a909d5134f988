#!/usr/bin/env bash
# Whether `brachyd doctor` tells the truth: asks it about a scene, runs the daemon with the model and rate that it
# names, beside an idle thread on the same deadlines, while a needle is replayed for a minute over TCP; 0 if the
# daemon holds the rate: at most 0.2 % of its deadlines missed more than the idle thread's.
#   scripts/campaigns/doctor_check.sh [SCENE [SECONDS]]      default: config/million_points.toml, 60; leave the
#       machine alone meanwhile
set -euo pipefail
cd "$(dirname "$0")/../.."
scene=${1:-config/million_points.toml}
seconds=${2:-60}
[[ $# -le 2 && -f $scene && $seconds =~ ^[1-9][0-9]*$ ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }

scripts/build.sh release brachyd brachy
bin=build/release/bin
work=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -rf "$work"' EXIT

status=0
$bin/brachyd doctor --config "$scene" --json >"$work/doctor.json" || status=$?
((status <= 1)) || exit 2
/usr/bin/python3 - "$work/doctor.json" "$scene" "$work/scene.toml" <<'PYTHON'
# Prints the answer, and writes the scene with the keys that it names.
import json, pathlib, sys
said = json.load(open(sys.argv[1]))
print("doctor:", said["answer"])
take = said["take"]
if not take:
    sys.exit("doctor_check: nothing fits, so there is nothing to hold it to")
keys = {"model": {"kernel": f'"{take["kernel"]}"'}, "rates": {"deformation_hz": take["deformation_hz"]}}
if "support_radius_mm" in take:
    keys["model"]["support_radius_mm"] = take["support_radius_mm"]
table, lines = "", []
for line in pathlib.Path(sys.argv[2]).read_text().splitlines():
    if line.startswith("["):
        table = line.strip("[]\n ").split("]")[0]
    elif line.split(" =")[0] in keys.get(table, {}):
        continue
    lines.append(line)
for name, values in keys.items():
    written = [f"{key} = {value}" for key, value in values.items()]
    at = lines.index(f"[{name}]") + 1 if f"[{name}]" in lines else len(lines)
    lines[at:at] = written if at < len(lines) or f"[{name}]" in lines else [f"[{name}]"] + written
pathlib.Path(sys.argv[3]).write_text("\n".join(lines) + "\n")
PYTHON

echo "doctor_check: the daemon so for $seconds s, with a replayed needle"
start_daemon "$work" --config "$work/scene.toml" --port 0 --control-thread --json
end=$((SECONDS + seconds))
while ((SECONDS < end)); do $bin/brachy replay config/insertion.csv --connect "$address" \
    --json >>"$work/replay.json"; done
end_daemon
tail -n 1 "$work/daemon.out" >"$work/summary.json"
/usr/bin/python3 - "$work/summary.json" <<'PYTHON'
import json, sys
s = json.load(open(sys.argv[1]))
share = lambda missed, ticks: 100 * missed / (missed + ticks)
daemon, idle = share(s["overruns"], s["ticks"]), share(s["control_overruns"], s["control_ticks"])
print(f'doctor_check: {s["ticks"]} ticks in {s["elapsed_s"]:.0f} s, p99 {s["tick_ms"]["p99"]:.2f} ms, '
      f'{s["overruns"]} missed ({daemon:.3f} %); idle thread {s["control_overruns"]} ({idle:.3f} %); '
      f'{s["poses_accepted"]} poses, {s["ticks_direct"] + s["ticks_mixed"] + s["ticks_condensed"]} ticks moved tissue')
held = daemon <= idle + 0.2 and s["poses_accepted"] > 0
print("doctor_check:", "held" if held else "NOT HELD: the doctor promised more than this machine keeps")
sys.exit(0 if held else 1)
PYTHON
