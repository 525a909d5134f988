#!/usr/bin/env bash
# Takes the pictures of the browser viewer from the running system: a needle goes in, the plan's seeds fall, a recording
# plays, and a probe lifts a gland that a bending needle enters; and of the score of a session with mistakes. Installs
# and builds what is missing; needs a browser (scripts/setup.sh --all). Two minutes. A picture that was taken while
# ticks were missed is not stored, and the script ends with an error: the machine is to be idle.
#   scripts/charts/screenshots.sh [FOLDER]     default: apps/viewer/pictures, apps/score/pictures
set -euo pipefail
cd "$(dirname "$0")/../.."
[[ $# -le 1 && ${1:-} != -* ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
pictures=${1:-apps/viewer/pictures}
score=${1:-apps/score/pictures}

scripts/setup.sh --all --pictures
scripts/build.sh release brachyd brachy viewer
bin=build/release/bin
out=$(mktemp -d)
. scripts/daemon.sh
trap 'kill_daemon; rm -rf "$out"' EXIT
mkdir -p "$pictures"

$bin/brachy plan --force --config config/session.toml --trajectory "$out/implant.csv" >/dev/null
awk -F, -v OFS=, 'NR > 1 && /^[0-9]/ {$1 /= 2} {print}' "$out/implant.csv" >"$out/quick.csv"  # 100 mm/s in, 40 mm/s out
start_daemon "$out" --config config/session.toml --trajectory "$out/quick.csv" --port 0 --http-port 0
until grep -q '^http on ' "$out/daemon.out"; do sleep 0.05; done
echo "screenshots: daemon on $address"
BRACHY=$bin/brachy node tests/viewer/screenshots.mjs "$(sed -n 's/^http on //p' "$out/daemon.out")" "$address" \
    "$out" "$pictures"
end_daemon >/dev/null
start_daemon "$out" --config config/theatre.toml --trajectory config/insertion_probe.csv --play --port 0 --http-port 0
until grep -q '^http on ' "$out/daemon.out"; do sleep 0.05; done
node tests/viewer/theatre_screenshot.mjs "$(sed -n 's/^http on //p' "$out/daemon.out")" "$pictures"
end_daemon >/dev/null
start_daemon "$out" --config config/session.toml --trajectory config/insertion_5mm_s.csv --play --port 0 --http-port 0
until grep -q '^http on ' "$out/daemon.out"; do sleep 0.05; done
node tests/viewer/ultrasound_screenshot.mjs "$(sed -n 's/^http on //p' "$out/daemon.out")" "$pictures"
end_daemon >/dev/null
mkdir -p "$score"
scripts/campaigns/sessions.py $bin/brachy "$out/sessions" --quick clinical_noise >/dev/null
node tests/viewer/score_screenshot.mjs "$out/sessions/clinical_noise/report.html" "$score/score.png"
pngquant --force --ext .png --speed 1 256 "$pictures"/*.png "$score"/*.png  # half a megabyte each, else
ls -l "$pictures" "$score"
