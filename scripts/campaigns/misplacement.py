#!/usr/bin/env python3
"""Runs scripts/campaigns/misplacement.sh's sessions and prints its table. Standard library only.

  misplacement.py BRACHY DIRECTORY SEEDS JSON_FILE ONLY
"""
import json
import os
import statistics
import subprocess
import sys

CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../config")
# Reason: what it adds to the scene, and how many locking needles are in place.
BEND = {"needle": {"flexible": "true", "bevel_force_share": 0.05, "guide_at": '"template"'}}
MOVE = {"gland": {"moves": "true"}}
LOCKED = {"needle": {"count": 3, "locking_count": 2}, **MOVE}
SWELL = {"swelling": {"on": "true"}}
RELAX = {"contact": {"relaxation_share": 0.5}}
QUIET = {"template_play_mm": 0, "tremor_mm": 0, "stop_s": 0, "drop_along_mm": 0, "drop_across_mm": 0,
         "migration_along_mm": 0}


def noise(*kept):
    return {"noise": {"on": "true", **{key: value for key, value in QUIET.items() if key not in kept}}}


def merged(*scenes):
    result = {}
    for scene in scenes:
        for section, keys in scene.items():
            result.setdefault(section, {}).update(keys)
    return result


REASONS = [
    ("nothing but the tissue", {}),
    ("needles bend, with a bevel", BEND),
    ("gland moves", MOVE),
    ("gland moves, two locking needles", LOCKED),
    ("gland swells", SWELL),
    ("reactions relax", RELAX),
    ("template play", noise("template_play_mm")),
    ("hand's tremor", noise("tremor_mm")),
    ("where the hand stops", noise("stop_s")),
    ("ejection", noise("drop_along_mm", "drop_across_mm")),
    ("migration", noise("migration_along_mm")),
    ("all, two locking needles", merged(BEND, LOCKED, SWELL, RELAX, noise(*QUIET))),
]
SPEEDS_MM_S = (20, 100)
LOCKING_S = 0.1  # the locking needles are in, and their gland where it was
LOCKING_XY = ((-7.5, 2.5), (7.5, 2.5))
HEADER = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,needle,button"


def scene_text(scene, seed):
    text = f'name = "misplacement"\n[plan]\nfile = "{CONFIG}/plan.toml"\n[seeds]\napplicator = "train"\n'
    for section, keys in scene.items():
        keys = {**keys, "seed": seed} if section == "noise" else keys
        text += f"[{section}]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())
    return text


def with_locking(rows):
    """The implant's rows as needle 0's, with needles 1 and 2 in the gland all the time."""
    result = [HEADER]
    for needle, (x, y) in enumerate(LOCKING_XY, 1):
        result.append(f"{0.001 * needle},1,0,0,{x},0,1,0,{y},0,0,1,12,{needle},0")
    end = 0.0
    for row in rows:
        cells = row.split(",")
        end = float(cells[0]) + LOCKING_S
        result.append(",".join([repr(end)] + cells[1:13] + ["0"] + cells[13:14]))
    for needle, (x, y) in enumerate(LOCKING_XY, 1):  # they stay
        result.append(f"{end + 0.001 * needle},1,0,0,{x},0,1,0,{y},0,0,1,12,{needle},0")
    first, rest = result[0], sorted(result[1:], key=lambda row: float(row.split(",")[0]))
    return "\n".join([first] + rest) + "\n"


def run(brachy, work, scene, speed, seed):
    config, implant, session = (os.path.join(work, name) for name in ("scene.toml", "implant.csv", "session"))
    with open(config, "w", encoding="utf-8") as file:
        file.write(scene_text(scene, seed))
    tools = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "check": True}
    subprocess.run([brachy, "plan", "--force", "--config", config, "--trajectory", implant, "--speed-mm-s", str(speed),
                    "--drop-speed-mm-s", str(0.4 * speed)], **tools)
    if scene.get("needle", {}).get("locking_count"):
        with open(implant, encoding="utf-8") as file:
            rows = file.read().split()[1:]
        with open(implant, "w", encoding="utf-8") as file:
            file.write(with_locking(rows))
    subprocess.run(["rm", "-rf", session], check=True)
    subprocess.run([brachy, "replay", implant, "--offline", "--config", config, "--session", session], **tools)
    score = subprocess.run([brachy, "score", session, "--plan", f"{CONFIG}/plan.toml", "--json"],
                           capture_output=True, check=True, text=True)
    os.remove(implant)
    return json.loads(score.stdout)["seeds"]["each"]


def summary(seeds):
    error = [seed["rest_error"] for seed in seeds]
    if not error:
        return None
    square = sum(e["total_mm"] ** 2 for e in error)
    apart = [[r - p for r, p in zip(seed["rest_mm"], seed["planned_mm"])] for seed in seeds]
    return {
        "seeds": len(seeds),
        "mean_mm": statistics.fmean(e["total_mm"] for e in error),
        "sd_mm": [statistics.pstdev(d[k] for d in apart) for k in range(3)],
        "along_mm": statistics.fmean(abs(e["axial_mm"]) for e in error),
        # Of the squares: of the clinic's 1.3, 1.5 and 3.8 mm, 79 %.
        "along_share": sum(e["axial_mm"] ** 2 for e in error) / square if square else 0.0,
    }


def main(brachy, work, seeds, out, only):
    rows = []
    print(f"{'reason':34s} {'mm/s':>5s} {'seeds':>6s} {'mean, mm':>9s} {'SD x, y, z, mm':>18s} {'along, mm':>10s}"
          f" {'along, %':>9s}", flush=True)
    for name, scene in REASONS:
        if only not in name:
            continue
        for speed in SPEEDS_MM_S:
            runs = int(seeds) if "noise" in scene else 1
            each = [seed for k in range(runs) for seed in run(brachy, work, scene, speed, k + 1)]
            row = summary(each)
            rows.append({"reason": name, "speed_mm_s": speed, "runs": runs, **(row or {})})
            if not row:
                print(f"{name:34s} {speed:5d}      0", flush=True)
                continue
            sd = ", ".join(f"{s:.2f}" for s in row["sd_mm"])
            print(f"{name:34s} {speed:5d} {len(each) // runs:6d} {row['mean_mm']:9.2f} {sd:>18s}"
                  f" {row['along_mm']:10.2f} {100 * row['along_share']:9.0f}", flush=True)
    with open(out, "w", encoding="utf-8") as file:
        json.dump(rows, file, indent=1)


if __name__ == "__main__":
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    main(*sys.argv[1:])
