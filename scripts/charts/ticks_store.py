#!/usr/bin/python3
"""Writes what `brachy ticks --choices` measured as the table that `[model] kernel = "auto"` chooses from.

usage: scripts/charts/ticks_store.py choices.json tests/reference/large_motion core/scene/choice/comparison.csv
A row for each setting and scene: the largest error at a point of the gland and the median time of a tick, of all
levels. Scenes with nodules have none, as the choice knows nothing of nodules. Commit the result: choices are made from
it, never from live timings.
"""
import json
import pathlib
import statistics
import sys
import tomllib

HEADER = ("model,kernel,support_mm,anchors,landmark_spacing_mm,surface,scene,contrast,poisson,free_faces,error_mm,"
          "tick_ms,min_det")


def main(rows_file, motions, out):
    levels = {}
    for row in json.loads(pathlib.Path(rows_file).read_text())["rows"]:
        levels.setdefault((row["model"], row["scene"]), []).append(row)
    lines = [HEADER]
    for (model, name), rows in levels.items():
        if any("error" in row for row in rows):
            continue
        scene = tomllib.loads((pathlib.Path(motions) / name / "scene.toml").read_text())
        if len(scene["region"]) > 1:
            continue
        contrast = scene["region"][0]["shear_modulus_kpa"] / scene["tissue"]["shear_modulus_kpa"]
        det = min(min(row["vertex_det"], 0) if row["verdict"] == "folded" else row["vertex_det"] for row in rows)
        first = rows[0]
        lines.append(",".join(str(cell) for cell in (
            model, first["kernel"], f"{first.get('support_mm', 0):g}", int(any(row["anchors"] for row in rows)),
            f"{first.get('landmark_spacing_mm', 0):.4g}", int(first["surface"]), name, f"{contrast:.6g}",
            scene["tissue"]["poisson"], 6 - len(scene["box"]["held"]), f"{max(row['max_mm'] for row in rows):.6g}",
            f"{statistics.median(row['evaluation_ms'] for row in rows):.4g}", f"{det:.4g}")))
    if len(lines) == 1:
        sys.exit(f"{rows_file}: no setting has a result; run brachy ticks --choices --json again")
    pathlib.Path(out).write_text("\n".join(lines) + "\n")
    print(f"ticks: {len(lines) - 1} rows stored in {out}")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
