#!/usr/bin/python3
"""Whole cases of every kind of file that clinics have, drawn at random with analytic truth, through `brachy import` and
the programs that read meshes, seeds and trajectories; judged by numpy alone.

usage: import_cases.py BRACHY N [SEED [FIRST]]     BRACHY: the program `brachy`, beside brachy-import
prints a line for each fault, and shares; exits with 1 below 98 % of the valid cases whole, or below 98 % of the clean
ones without a warning, and where one that must be refused or warned of is not.

A case is a pelvis of ellipsoids and tubes (case_shapes.py) in files (case_files.py): contours, a DICOM segmentation or
label maps; beside them images, a dose, a plan, seeds, and files that are of no use here. Some are wrong on purpose:
mirrored, turned over, in centimetres, or with left and right exchanged, and must have a warning; some are ambiguous and
must be refused. Others are scenes of meshes, and tables of seeds and of poses. Truth: what slabs of the contours' own
areas hold, voxels summed by numpy, figures of the shapes: position to 0.1 mm, volume to 1 %, extent, role and side.
IMPORT_CASES_KEEP=FOLDER keeps the files of cases that fail.
"""
import multiprocessing
import os
import pathlib
import shutil
import sys
import tempfile

try:
    import numpy as np
    import pydicom
except ImportError as missing:
    print(f"import_cases: {missing}; install python3-pydicom", file=sys.stderr)
    sys.exit(77)
sys.path += [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).resolve().parents[2] / "reference/dose")]
from case_judges import judge_patient  # noqa: E402
from case_patients import outlines, patient  # noqa: E402
from case_tables import (judge_meshes, judge_poses_table, judge_seeds_table, meshes, poses_table,  # noqa: E402
                         seeds_table)
from tg43_numpy import Source  # noqa: E402

pydicom.config.settings.writing_validation_mode = pydicom.config.IGNORE
pydicom.config.settings.reading_validation_mode = pydicom.config.IGNORE
SOURCES = pathlib.Path(__file__).resolve().parents[3] / "config/sources"


class Case:
    """What is in the folder, and what should come of it."""

    def __init__(self, number, seed, folder):
        self.rng, self.folder, self.number = np.random.default_rng([seed, number]), folder, number
        self.structures = {}  # in the file: role, cc, middle, jitter, extent, axes
        self.left = []  # words of one line each
        self.refused = self.warned = self.image = self.dose = self.seeds = self.hdr = self.template = None
        self.options, self.is_image_taken, self.is_anatomy = [], False, True
        self.what = []

    def pick(self, *ways):
        way = ways[self.rng.integers(len(ways))]
        self.what.append(str(way))
        return way

    def chance(self, share):
        return bool(self.rng.random() < share)


KINDS = [(patient, judge_patient)] * 7 + [(outlines, judge_patient), (meshes, judge_meshes),
                                         (seeds_table, judge_seeds_table), (poses_table, judge_poses_table)]


def run(task):
    program, number, seed, sources = task
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        (work / "in").mkdir()
        case = Case(number, seed, work / "in")
        case.sources = sources
        make, judge = KINDS[number % len(KINDS)]
        case.what.append(make.__name__)
        make(case)
        try:
            faults = judge(case, work / "out", program)
        except (KeyError, ValueError, OSError, IndexError) as e:
            faults = [f"cannot be judged: {type(e).__name__}: {e}"]
        keep = os.environ.get("IMPORT_CASES_KEEP")
        if keep and faults:
            shutil.copytree(work, pathlib.Path(keep) / str(number), dirs_exist_ok=True)
    kind = "refused" if case.refused else "warned" if case.warned else "clean"
    return number, kind, faults, " | ".join(case.what)


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    count = int(sys.argv[2])
    seed, first = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((3, 1), (4, 0)))
    sources = {file.stem: Source(file) for file in SOURCES.glob("*.toml")}
    tasks = [(program, number, seed, sources) for number in range(first, first + count)]
    all_of = {"clean": 0, "warned": 0, "refused": 0}
    whole = dict(all_of)
    unwarned = 0
    with multiprocessing.Pool(min(os.cpu_count(), count)) as pool:
        for number, kind, faults, what in pool.imap(run, tasks):
            for fault in faults:
                print(f"case {number} ({what}): {fault}", flush=True)
            all_of[kind] += 1
            whole[kind] += not faults
            unwarned += kind == "clean" and not any(f.startswith("WARNING") for f in faults)
    print(f"import_cases: of {count} cases {all_of['clean']} are clean: {whole['clean']} are whole, {unwarned} without "
          f"a warning; {whole['warned']} of {all_of['warned']} wrong ones are warned of, {whole['refused']} of "
          f"{all_of['refused']} ambiguous ones refused")
    least = 0.98 * all_of["clean"]
    return int(whole["clean"] < least or unwarned < least or whole["warned"] < all_of["warned"]
               or whole["refused"] < all_of["refused"])


if __name__ == "__main__":
    sys.exit(main())
