#!/usr/bin/env bash
# Shows that two builds compute and send the same bits. It runs the programs of both and compares state hashes,
# deformations, doses, messages on the wire and recordings. One line for each comparison; fails if any differs.
# Five minutes.
#   scripts/same_bits.sh OLD_BIN_DIR NEW_BIN_DIR [FILTER]     FILTER: a part of the names of the comparisons to run
# Scenes and trajectories are those of this tree's config/. Trajectories are cut short where the whole takes long,
# and the instruction set is pinned to SSE4. Compared are the JSON reports and the files written, byte for byte. Not
# compared: running times, texts for people, and of messages the clocks, counts of dropped snapshots, and texts (see
# same_bits_wire.py).
set -euo pipefail
(($# == 2 || $# == 3)) && [[ -x $1/brachy && -x $2/brachy ]] || { sed -n '2,/^[^#]/s/^# \?//p' "$0" >&2; exit 2; }
old=$(realpath "$1")
new=$(realpath "$2")
filter=${3:-}
cd "$(dirname "$0")/.."
work=$(mktemp -d /tmp/brachy-same-bits-XXXXXX)
trap 'rm -rf "$work"' EXIT
mkdir "$work/old" "$work/new"
cp -r config "$work/config"
# Versions before [work_costs] refuse that section; the scenes here have its defaults.
sed -i '/^# What a tick.s work costs/,/^$/d' "$work"/config/*.toml
compared=0
different=0

# drop_times: a JSON report without what is measured by the clock, with the present names of keys, without the model
# `multiscale`, which is retired, and without what earlier versions do not say of bent needles.
drop_times() {
  python3 -c '
import json, sys
renamed = {"reseated": "reinitialized", "rungs": "models"}
def without_times(value):
    if isinstance(value, dict):
        return {renamed.get(k, k): without_times(v) for k, v in value.items()
                if not k.endswith(("_ms", "_us", "_per_s")) and k not in ("elapsed_s", "wall_s", "hand", "written", \
                    "out", "simd", "multiscale", "ticks_steep", "frames_steep", "max_tip_deflection_mm")}
    if not isinstance(value, list):
        return value
    return [without_times(v) for v in value
            if not (isinstance(v, dict) and str(v.get("model", "")).startswith("multiscale"))]
text = sys.stdin.read()
print(json.dumps(without_times(json.loads(text)), indent=0, sort_keys=True))'
}

# compare NAME COMMAND…: runs the command in both builds, as `brachy` in directories of their own, and compares what
# it writes to files and prints as JSON.
compare() {
  local name=$1 side pid failed=0; shift
  [[ $name == *"$filter"* ]] || return 0
  local folders=() pids=()
  for side in old new; do
    local folder="$work/$side/${name//[^a-zA-Z0-9_]/_}"
    mkdir -p "$folder"
    folders+=("$folder")
    (
      cd "$folder"
      "${!side}/brachy" "$@" >"$folder.json" 2>"$folder.err"
      drop_times <"$folder.json" >report.json
      rm -rf session/states  # of their own version's members
      # Of force logs the columns that earlier versions have.
      if [[ -f forces.csv ]]; then cut -d, -f1-13 forces.csv >kept && mv kept forces.csv; fi
    ) &
    pids+=($!)
  done
  for pid in "${pids[@]}"; do wait "$pid" || failed=1; done
  verdict "$name" "$failed" "${folders[@]}"
}

# verdict NAME FAILED OLD NEW: compares two directories, and says whether they hold the same.
verdict() {
  local name=$1 failed=$2 what
  compared=$((compared + 1))
  what=$(sed -n 's/^"state_hash": "\([0-9a-f]*\)",\?$/\1/p' "$4/report.json" 2>/dev/null || true)
  [[ $what ]] || what="$(find "$4" -type f | wc -l) files, $(du -sb "$4" | cut -f1) bytes"
  if ((failed)); then
    different=$((different + 1))
    echo "FAILED     $name: $(tail -qn 2 "$3.err" "$4.err" | tr '\n' ' ')"
  elif diff -rq "$3" "$4" >"$work/diff"; then
    echo "same       $name: $what"
  else
    different=$((different + 1))
    echo "DIFFERENT  $name"
    diff -r "$3" "$4" | head -n 12 | cut -c 1-160 || true
  fi
}

# cut_short FILE SECONDS: the rows of a trajectory up to a time; prints the name of the new file.
cut_short() {
  local short
  short="$work/$(basename "$1" .csv)_$2.csv"
  awk -F, -v end="$2" '/^#/ || /^t_s/ || $1 + 0 <= end + 0' "$1" >"$short"
  echo "$short"
}

# 1. State hashes: every scene with its trajectory.
scenes=$work/config
replay=(--offline --simd sse4 --json)
for scene in "$scenes"/*.toml; do
  name=$(basename "$scene" .toml)
  case $name in
    plan | hdr_plan) continue ;;  # plans, not scenes
    perineum) trajectory=config/perineum_5mm_s.csv ;;
    three_needles) trajectory=config/insertion_three_needles.csv ;;
    million_points) trajectory=$(cut_short config/insertion.csv 4) ;;
    *) trajectory=config/insertion.csv ;;
  esac
  compare "scene $name" replay "$(realpath "$trajectory")" "${replay[@]}" --config "$scene" --log forces.csv
done
compare "trajectory insertion_5mm_s" replay "$PWD/config/insertion_5mm_s.csv" "${replay[@]}" \
    --config "$scenes/prostate.toml"

# 2. Every kernel on the default scene, with and without a stiffer region where it knows moduli.
for kernel in psi30 psi31 psi32 buhmann compact_elastic elastic fem; do
  sed "s/^kernel = .*/kernel = \"$kernel\"/" "$scenes/prostate.toml" >"$scenes/kernel_$kernel.toml"
  trajectory=$(cut_short config/insertion.csv 4)
  compare "kernel $kernel" replay "$trajectory" "${replay[@]}" --config "$scenes/kernel_$kernel.toml" --log forces.csv
done
cat "$scenes/kernel_elastic.toml" - >"$scenes/region_elastic.toml" <<'REGION'
[[region]]
shape = "ellipsoid"
centre_mm = [0, 0, 0]
semi_axes_mm = [15, 12, 14]
shear_modulus_kpa = 12
REGION
sed 's/^kernel = .*/kernel = "fem"/' "$scenes/region_elastic.toml" >"$scenes/region_fem.toml"
for kernel in elastic fem; do
  compare "region $kernel" replay "$(cut_short config/insertion.csv 4)" "${replay[@]}" \
      --config "$scenes/region_$kernel.toml"
done
compare "device dynamics" replay "$PWD/config/insertion.csv" "${replay[@]}" --config "$scenes/prostate.toml" \
    --device-dynamics \
  --delay-ms 20 --drop 0.01

# 3. A whole implant: the plan, its trajectory, the 75 seeds, the session's files, and the judgement of them.
compare "plan" plan --config "$scenes/session.toml" --trajectory needles.csv --seeds seeds.csv \
    --structures structures --json
compare "plan generated" plan --generate --config "$scenes/prostate.toml" --out plan.toml --csv plan.csv --json
needles=$work/needles.csv
"$old/brachy" plan --config "$scenes/session.toml" --trajectory "$needles" --seeds "$work/plan_seeds.csv" >/dev/null
"$old/brachy" inspect "$scenes/prostate.toml" --out "$work/surface.ply" >/dev/null
compare "session of 75 seeds" replay "$needles" "${replay[@]}" --config "$scenes/session.toml" --session session
compare "metrics" metrics "$needles" --mesh "$work/surface.ply" --json

# 4. brachy deform, on every kernel. Landmarks: a needle's shaft, contacts, anchors.
python3 - "$work" <<'POINTS'
import math, pathlib, random, sys
folder = pathlib.Path(sys.argv[1])
random.seed(7)
shaft = [(2.0, -3.0, -18.0 + 5 * i, 0.6 + 0.05 * i, 0.3, 1.5 - 0.1 * i) for i in range(6)]
anchors = [(15 * math.cos(a), 12 * math.sin(a), z, 0, 0, 0) for a, z in ((0.3, -12), (1.9, 12), (3.5, -12), (5.1, 12))]
rows = shaft + anchors
folder.joinpath("landmarks.csv").write_text("x,y,z,dx,dy,dz\n" + "".join(",".join(map(repr, r)) + "\n" for r in rows))
folder.joinpath("cores.csv").write_text("x,y,z,dx,dy,dz,core_mm\n" +
                                       "".join(",".join(map(repr, r)) + ",4\n" for r in rows))
supports = "".join(",".join(map(repr, r)) + f",{12 + i % 3}\n" for i, r in enumerate(rows))
folder.joinpath("supports.csv").write_text("x,y,z,dx,dy,dz,support\n" + supports)
points = [tuple(random.uniform(-20, 20) for _ in range(3)) for _ in range(2000)]
folder.joinpath("points.csv").write_text("x,y,z\n" + "".join(",".join(map(repr, p)) + "\n" for p in points))
seeds = [(random.uniform(-15, 15), random.uniform(-12, 12), random.uniform(-14, 14), random.uniform(-0.2, 0.2), 0.1, 1,
          ("6711", "200")[i % 2], 0.5) for i in range(40)]
folder.joinpath("seeds.csv").write_text("x,y,z,ax,ay,az,source,strength_u\n" +
                                        "".join(",".join(str(v) for v in s) + "\n" for s in seeds))
POINTS
landmarks=(--points "$work/points.csv" --out deformed.csv --jacobian --json --landmarks)
for kernel in psi30 psi31 psi32 buhmann compact_elastic; do
  compare "deform $kernel" deform "${landmarks[@]}" "$work/landmarks.csv" --kernel $kernel --support 20 \
    --core-radius 4
done
compare "deform elastic, unbounded" deform "${landmarks[@]}" "$work/cores.csv" --kernel elastic
for kernel in elastic fem; do
  compare "deform $kernel, scene" deform "${landmarks[@]}" "$work/landmarks.csv" --scene "$scenes/prostate.toml" \
      --kernel $kernel
  compare "deform $kernel, region" deform "${landmarks[@]}" "$work/landmarks.csv" --scene "$scenes/region_$kernel.toml"
done
compare "deform supports" deform "${landmarks[@]}" "$work/supports.csv" --kernel psi31
compare "inspect scene" inspect "$scenes/prostate.toml" --out surface.ply --json
compare "inspect mesh" inspect "$work/surface.ply" --out again.ply --json
compare "deform mesh" deform --mesh "$work/surface.ply" --landmarks "$work/landmarks.csv" --out deformed.ply \
    --kernel psi31 --support 20 --json

# 5. Dose.
compare "dose" dose --seeds "$work/seeds.csv" --points "$work/points.csv" --out dose.csv \
    --config "$scenes/prostate.toml" \
  --grid grid.nrrd --json
compare "dose of the plan" dose --seeds "$work/plan_seeds.csv" --config "$scenes/session.toml" --json
compare "advise" advise "$scenes/prostate.toml" --json

# 6. Wire and recordings.
if [[ "wire and recordings" == *"$filter"* ]]; then
  compared=$((compared + 1))
  python3 scripts/ci/same_bits_wire.py "$old" "$new" "$scenes" "$work" || different=$((different + 1))
  for recording in "$work"/old_recording.brachy "$work"/new_recording.brachy; do
    name=$(basename "$recording" .brachy)
    if [[ ! -s $recording ]]; then echo "FAILED     $name: no recording"; different=$((different + 1)); continue; fi
    filter= compare "recording inspected: $name" inspect "$recording" --json
    filter= compare "recording exported: $name" export "$recording" --out exported --json
    filter= compare "recording replayed: $name" replay "$recording" "${replay[@]}" --config "$work/wire.toml"
  done
fi

((compared)) || { echo "same_bits: no comparison is called '$filter'" >&2; exit 2; }
if ((different)); then echo "same_bits: $different comparisons differ" >&2; exit 1; fi
echo "same_bits: all comparisons are the same"
