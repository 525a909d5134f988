#!/usr/bin/python3
"""Writes what `brachy compare --json` measured as the table that `[model] kernel = "auto"` chooses from.

usage: scripts/charts/compare_store.py compare.json tests/reference core/scene/choice/comparison.csv
The engine's own models on linear scenes only. Commit the result: choices are made from it, never from live timings.
"""
import json
import pathlib
import sys
import tomllib

HEADER = ("model,kernel,support_mm,anchors,landmark_spacing_mm,surface,scene,contrast,poisson,free_faces,error_mm,"
          "tick_ms,min_det")


def main(rows_file, references, out):
    data = json.loads(pathlib.Path(rows_file).read_text())
    lines = [HEADER]
    for row in data["rows"]:
        if row["family"] not in ("psi", "matrix") or not row["counts"] or "error" in row:
            continue
        scene = tomllib.loads((pathlib.Path(references) / row["scene"] / "scene.toml").read_text())
        contrast = scene["region"][0]["shear_modulus_kpa"] / scene["tissue"]["shear_modulus_kpa"]
        lines.append(",".join(str(cell) for cell in (
            row["model"], row["kernel"] or row["model"], f"{row.get('support_mm', 0):g}", int(row["anchors"]),
            f"{row.get('landmark_spacing_mm', 0):.4g}", int(row["surface"]), row["scene"], f"{contrast:.6g}",
            scene["tissue"]["poisson"], 6 - len(scene["box"]["held"]), f"{row['target_max_mm']:.6g}",
            f"{max(row['tick_ms'], row.get('advance_ms', 0)):.4g}", f"{row['min_det']:.4g}")))
    pathlib.Path(out).write_text("\n".join(lines) + "\n")
    print(f"compare: {len(lines) - 1} rows stored in {out}")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
