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
sys.path.insert(0, str(ROOT / "tests/reference/dose"))
from tg43_numpy import Source  # noqa: E402

HALF_LIFE_H = 24 / np.log(2)
FILES = {"192": "mhdr-v2", "6711": "6711"}  # of sources, by their names in tables of seeds
JUDGED = 2  # draws
MARGIN_MM = 25  # beside the gland; what lies farther out counts in no figure


def ball(radius, middle):
    """Triangles of a sphere, from an icosahedron divided four times."""
    g = (1 + 5**0.5) / 2
    corners = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
                        (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)], float)
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
    t = corners[np.array(faces)]
    for _ in range(4):
        a, b, c = t[:, 0], t[:, 1], t[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        t = np.concatenate([np.stack(s, 1) for s in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return middle + radius * t / np.linalg.norm(t, axis=2, keepdims=True)


def rod(radius, middle, half_length):
    """A cylinder along z with round ends: the upper and the lower half of a ball, drawn apart."""
    t = ball(radius, np.zeros(3))
    t[..., 2] += half_length * np.sign(np.round(t[..., 2], 9))
    # What crosses the equator was drawn out with its corners, those on it to neither side: both rims meet there.
    return middle + t


def rod_outside(p, radius, middle, half_length):
    d = p - middle
    d[:, 2] -= np.clip(d[:, 2], -half_length, half_length)
    return np.linalg.norm(d, axis=1) - radius


def write_stl(file, triangles):
    with open(file, "wb") as out:
        out.write(bytes(80) + np.uint32(len(triangles)).tobytes())
        records = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("end", "<u2")])
        records["corners"] = triangles
        out.write(records.tobytes())


def figures(gy, mm3, prescription):
    """By the volume of each dose, hottest first."""
    order = np.sort(gy)[::-1]
    cc = mm3 * 1e-3 * np.arange(1, len(order) + 1)

    def hottest(volume):
        return float(np.interp(volume, cc, order))

    return {"V100": 100 * np.mean(gy >= prescription), "V150": 100 * np.mean(gy >= 1.5 * prescription),
            "D90": hottest(0.9 * cc[-1]), "D10": hottest(0.1 * cc[-1]), "D30": hottest(0.3 * cc[-1]),
            "D2cc": hottest(2.0)}


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
