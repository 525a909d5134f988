#!/usr/bin/python3
"""Solves the reference scenes of tests/reference with CalculiX, and checks what is stored there.

examples:
  apps/lab/reference/run.py --list
  apps/lab/reference/run.py --scene lateral_stiff --level coarse   # solve it again, compare with the stored level
  apps/lab/reference/run.py --all --level coarse                   # the same for every scene, a few minutes
  apps/lab/reference/run.py --scene lateral_stiff                  # regenerate one scene: refine until converged, store
  apps/lab/reference/run.py --all                                  # regenerate everything (half an hour or more)
  apps/lab/reference/run.py --scene short_contacts/disc_along      # one of tests/reference/short_contacts
  apps/lab/reference/run.py --scene large_motion/drag              # one of tests/reference/large_motion, likewise
  apps/lab/reference/run.py --table                                # only rewrite tests/reference/CONVERGENCE.md

Each ccx runs under nice, with one thread. Exit codes: 0 done, 1 disagrees or not converged, 2 bad input or a program
missing.
"""
import argparse
import pathlib
import sys
import tempfile

import numpy as np

import large_motion
import stored
from scene import LEVELS, UserError, load_scene
from solution import Solution, difference

ROOT = pathlib.Path(__file__).resolve().parents[3] / "tests" / "reference"
ENOUGH = 0.01  # two levels differing by less: no further refinement
ACCEPTED = 0.02  # the most that the last two levels may differ


def regenerate(folder, work, timeout_s):
    """Refines until two levels agree, stores the finer one; False if they never do."""
    scene = load_scene(folder)
    field_points, targets = stored.evaluation_points(scene)
    points = np.vstack([field_points, targets])
    judged = slice(0, len(field_points))
    solutions, rows = [], []
    for level in LEVELS:
        solution = Solution(scene, level, points, work, timeout_s)
        row = solution.row
        row["rel_l2_to_previous"] = row["max_mm_to_previous"] = ""
        if solutions:
            u, before = solution.displacements[-1][judged], solutions[-1].displacements[-1][judged]
            row["rel_l2_to_previous"] = difference(before, u)
            row["max_mm_to_previous"] = float(np.linalg.norm(u - before, axis=1).max())
            print(
                f"{'':24} differs from the previous level by {row['rel_l2_to_previous']:.2%} "
                f"(at most {row['max_mm_to_previous']:.3f} mm)",
                flush=True,
            )
        solutions.append(solution)
        rows.append(row)
        if level == scene.finest or (row["rel_l2_to_previous"] != "" and row["rel_l2_to_previous"] < ENOUGH):
            break
    finest = solutions[-1]
    linearity = linear_beside(scene, finest, judged, timeout_s) if scene.neo_hookean else None
    stored.write(
        folder,
        scene,
        points,
        len(field_points),
        finest.displacements[-1],
        solutions[0].displacements[-1],
        solutions[0].geo,
        rows,
        linearity,
    )
    return rows[-1]["rel_l2_to_previous"] < ACCEPTED


def linear_beside(scene, finest, judged, timeout_s):
    """For each amplitude of a neo-Hookean scene, how far the linear solution on the same mesh is from it."""
    u = finest.linear(timeout_s)[judged]
    rows = []
    for share, reference in zip(scene.amplitudes, finest.displacements):
        rows.append(
            {
                "needle_displacement_mm": share * float(np.linalg.norm(scene.load.displacement)),
                "rel_l2": difference(share * u, reference[judged]),
                "max_mm": float(np.linalg.norm(share * u - reference[judged], axis=1).max()),
            }
        )
        print(
            f"{'':24} linear at {rows[-1]['needle_displacement_mm']:g} mm: off by {rows[-1]['rel_l2']:.1%}",
            flush=True,
        )
    return rows


def recheck(folder, level, work, timeout_s):
    """Solves a stored level again and compares. The same deck must give the same numbers; another one (another gmsh or
    processor meshes a little differently) must be as near to the stored finest level as the stored level was."""
    scene = load_scene(folder)
    points, split, finest, coarse = stored.read(folder)
    rows = {row["level"]: row for row in stored.read_convergence(folder)}
    last = list(rows)[-1]
    if level not in ("coarse", last):
        raise UserError(f"{folder.name}: only coarse and {last} are stored; check one of them")
    reference = coarse if level == "coarse" else finest
    solution = Solution(scene, level, points, work, timeout_s)
    u = solution.displacements[-1]
    same_deck = solution.row["deck_sha256"] == rows[level]["deck_sha256"]
    if same_deck:
        found, limit, what = (
            difference(u, reference),
            1e-4,
            "from the stored level, the same deck",
        )  # stored to 1e-5 mm
    else:
        limit = 1.5 * difference(coarse[:split], finest[:split])
        found, what = difference(u[:split], finest[:split]), "from the stored finest level, another mesh"
    agrees = found <= limit
    print(
        f"{'agrees' if agrees else 'DISAGREES'}: {scene.name} {level}: {found:.2e} (≤ {limit:.2e}) {what}", flush=True
    )
    return agrees


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--scene", metavar="NAME", nargs="+", help="folders of tests/reference")
    what.add_argument("--all", action="store_true", help="every scene but those of large_motion")
    what.add_argument("--list", action="store_true", help="the scenes' names")
    what.add_argument("--table", action="store_true", help="write CONVERGENCE.md from what is stored")
    parser.add_argument(
        "--level", choices=LEVELS, help="solve only this level, compare with what is stored, store nothing"
    )
    parser.add_argument("--work", metavar="DIR", help="keep meshes, decks and logs here")
    parser.add_argument(
        "--timeout", metavar="S", type=float, default=1800, help="for one ccx, wall clock (default 1800)"
    )
    options = parser.parse_args()

    names = stored.names(ROOT, "scene.toml")
    large = [f"large_motion/{name}" for name in large_motion.names(ROOT)]
    if options.list:
        print("\n".join(names + large))
        return 0
    for name in options.scene or []:
        if name not in names + large:
            raise UserError(f"no scene {name} in {ROOT}; there are {', '.join(names + large)}")
    good = True
    if not options.table:
        with tempfile.TemporaryDirectory(prefix="brachy-reference-") as scratch:
            work = pathlib.Path(options.work or scratch)
            work.mkdir(parents=True, exist_ok=True)
            for name in options.scene or names:
                is_large = name in large
                if options.level:
                    again = large_motion.recheck if is_large else recheck
                    good &= again(ROOT / name, options.level, work, options.timeout)
                else:
                    refine = large_motion.regenerate if is_large else regenerate
                    good &= refine(ROOT / name, work, options.timeout)
    if not options.level and not (options.scene and set(options.scene) <= set(large)):
        stored.write_table(ROOT)
    return 0 if good else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"reference: {error}", file=sys.stderr)
        sys.exit(2)
