#!/usr/bin/python3
"""`brachy robust` judged by numpy: the figures of its draws.

usage: robust_draws.py BRACHY [COUNT [FIRST]]     default: 2 cases from number 0; exits with 1 if any fails

Each case is a ball of gland with a straight urethra and a straight rectum, whose distances are known exactly, a plan of
seeds or of catheters that `brachy plan` makes for it, and drawn standard deviations. Of some draws the sources are
written, and the dose is summed in numpy by TG-43U1 at a finer lattice than the program has, in structures that differ
as the draw says: V100 of the gland to 0.3 points, V150 to 0.8, doses to 2 %.
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError as missing:
    print(f"robust_draws: {missing}; install python3-numpy", file=sys.stderr)
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/reference/dose"), str(ROOT / "tests/apps")]
from exact_shapes import ball, figures, rod, rod_outside, write_stl  # noqa: E402
from tg43_numpy import Source  # noqa: E402

HALF_LIFE_H = 24 / np.log(2)
FILES = {"192": "mhdr-v2", "6711": "6711"}  # of sources, by their names in tables of seeds
JUDGED = 2  # draws
MARGIN_MM = 25  # beside the gland; what lies farther out counts in no figure


class Case:
    def __init__(self, number, work):
        self.random = np.random.default_rng(4900 + number)
        self.is_hdr = number % 2 == 0
        self.work = work
        r = self.random
        self.middle = r.uniform(-3, 3, 3)
        self.radius = r.uniform(17, 22)
        self.urethra = (r.uniform(2.5, 3.5), self.middle + np.array([r.uniform(-1, 1), r.uniform(-2, 2), 0]), 24.0)
        self.rectum = (11.0, self.middle + np.array([0, -self.radius - r.uniform(13, 15), 0]), 30.0)
        self.sd = {"strength_percent": r.uniform(0, 4), "calculation_percent": r.uniform(0, 4), "medium_percent": 1.0,
                   "dwell_s": r.uniform(0, 0.3), "source_along_mm": r.uniform(0, 2),
                   "reconstruction_along_mm": r.uniform(0, 2), "reconstruction_across_mm": r.uniform(0, 2),
                   "movement_along_mm": r.uniform(0, 1), "movement_across_mm": r.uniform(0, 1),
                   "drift_mm": r.choice([0.0, 1.8]), "gland_outline_mm": r.uniform(0, 1.2),
                   "urethra_outline_mm": r.uniform(0, 0.4), "organ_outline_mm": r.uniform(0, 0.8),
                   "gland_movement_mm": list(r.uniform(0, 1, 3)), "swelling_percent": r.choice([0.0, 8.0])}
        self.noise = {"template_play_mm": r.uniform(0, 1), "drop_along_mm": r.uniform(0, 2),
                      "drop_across_mm": r.uniform(0, 2), "migration_along_mm": r.uniform(0, 2)}

    def write(self):
        write_stl(self.work / "gland.stl", ball(self.radius, self.middle))
        write_stl(self.work / "urethra.stl", rod(*self.urethra))
        write_stl(self.work / "rectum.stl", rod(*self.rectum))
        keys = "\n".join(f"{k} = {v}" for k, v in self.sd.items())
        noise = "\n".join(f"{k} = {v}" for k, v in self.noise.items())
        origin = [float(self.middle[0] - 30), float(self.middle[1] - 30), float(self.middle[2] - self.radius - 40)]
        (self.work / "scene.toml").write_text(
            f'name = "case"\n[tissue]\nmesh = "gland.stl"\n[template]\norigin_mm = {origin}\n'
            f'[implant]\nkind = "{"hdr" if self.is_hdr else "ldr"}"\n[dose]\nmargin_mm = {MARGIN_MM}\n'
            f'[noise]\n{noise}\n[uncertainty]\n{keys}\n'
            f'[[structure]]\nname = "urethra"\nfile = "urethra.stl"\n'
            f'[[structure]]\nname = "rectum"\nfile = "rectum.stl"\n')

    def points(self, draw, name, spacing):
        """Points of a structure as a draw has it, in the frame of the sources, and the volume of each."""
        stretch = draw["stretch"] if name != "rectum" else 1.0
        if name == "prostate":
            reach, middle = self.radius + 4, self.middle
            box = [np.arange(-reach, reach, spacing) + spacing / 3] * 3
        else:
            radius, middle, half = self.urethra if name == "urethra" else self.rectum
            box = [np.arange(-radius - 3, radius + 3, spacing) + spacing / 3] * 2
            box.append(np.arange(-half - radius - 3, half + radius + 3, spacing) + spacing / 3)
        p = np.stack(np.meshgrid(*box, indexing="ij"), -1).reshape(-1, 3) + middle
        if name == "prostate":
            inside = np.linalg.norm(p - self.middle, axis=1) - self.radius <= draw["gland_outline_mm"]
        else:
            shape = self.urethra if name == "urethra" else self.rectum
            outline = draw["urethra_outline_mm" if name == "urethra" else "organ_outline_mm"]
            inside = rod_outside(p.copy(), *shape) <= outline
            inside &= np.all(np.abs(p - self.middle) <= self.radius + MARGIN_MM + 0.5, axis=1)
        p = p[inside]
        if name == "rectum":
            return p + np.array(draw["organs_moved_mm"]), spacing**3
        return self.middle + stretch * (p - self.middle), (stretch * spacing) ** 3


def read_seeds(file):
    with open(file) as rows:
        table = list(csv.DictReader(rows))
    numbers = np.array([[float(row[k]) for k in ("x", "y", "z", "ax", "ay", "az", "strength_u")] for row in table])
    return table[0]["source"], numbers


def dose(model, seeds, points):
    source = Source(ROOT / f"config/sources/{FILES[model]}.toml")
    rates = sum(s[6] * source.rate(points, s[:3], s[3:6]) for s in seeds)
    return rates * 0.01 * source.half_life * HALF_LIFE_H


def run(brachy, number, work):
    faults = []

    def call(*arguments):
        done = subprocess.run([brachy, *map(str, arguments)], capture_output=True, text=True, cwd=work, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"case {number}: brachy {' '.join(map(str, arguments))}: {done.stderr.strip()[-300:]}")
        return done.stdout

    case = Case(number, work)
    case.write()
    scene = ("--config", "scene.toml", "--force")
    kind = ("--hdr",) if case.is_hdr else ("--method", "rule")
    call("plan", "--generate", *kind, *scene, "--out", "plan.toml")
    whole = json.loads(call("robust", "plan.toml", *scene, "--draws", JUDGED, "--csv", "draws.csv", "--json"))
    with open(work / "draws.csv") as rows:
        drawn = list(csv.DictReader(rows))
    for k in range(JUDGED):
        told = json.loads(call("robust", "plan.toml", *scene, "--draws", 1, "--draw", k, "--seeds", "s.csv", "--json"))
        model, seeds = read_seeds(work / "s.csv")
        for name, spacing in (("prostate", 1.0), ("urethra", 0.5), ("rectum", 1.0)):
            points, mm3 = case.points(told["draw"], name, spacing)
            true = figures(dose(model, seeds, points), mm3, whole["prescription_gy"])
            for figure, limit in (("V100", 0.3), ("V150", 0.8), ("D90", None), ("D10", None), ("D30", None),
                                  ("D2cc", None)):
                if f"{name} {figure}" not in drawn[k] or (name != "prostate" and limit):
                    continue
                value = float(drawn[k][f"{name} {figure}"])
                most = limit or 0.02 * true[figure]
                if abs(value - true[figure]) > most:
                    faults.append(f"case {number}, draw {k}: {name} {figure} {value:.2f}, by numpy {true[figure]:.2f}")
    return faults


def main():
    brachy = str(pathlib.Path(sys.argv[1]).resolve())
    count, first = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((2, 2), (3, 0)))
    faults = []
    for number in range(first, first + count):
        with tempfile.TemporaryDirectory() as work:
            faults += run(brachy, number, pathlib.Path(work))
    print("\n".join(faults))
    print(f"robust_draws: {count - len({f.split(',')[0].split(':')[0] for f in faults})} of {count} cases are right")
    return 1 if faults else 0


sys.exit(main())
