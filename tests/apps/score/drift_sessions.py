#!/usr/bin/python3
"""The exercise of a second fraction judged by numpy: catheters that have drifted, corrected or not.

usage: drift_sessions.py BRACHY [COUNT [FIRST]]     default: 2 sessions from number 0; exits with 1 if one is wrong

Each session is a ball of gland with a urethra and a rectum, six catheters that `brachy plan` makes for it, and a drift
of 1.8 mm (SD) by [noise] of a seed of its own, with the bounds of the shipped exercise. It is flown twice by `brachy
replay --offline`: as planned, by a hand that does not notice, and with every tip moved by what the first flight's was
off.

All catheters are off by the same, along themselves alone. Not corrected the exercise is failed where the drift is
beyond its bound, and the mistake is named with all catheters, its direction and its size to 0.1 mm; corrected it is
passed and nothing is named. V100 and D90 of the gland, as planned and as delivered, are those of numpy by TG-43U1 for
the dwells where catheters.csv has their tissue at rest, to 0.3 points and 1 %: so is what the drift costs. What each
catheter adds to the gland's mean dose is numpy's to 5 %, most of it beside the source, where a grid of 1 mm is coarse;
their sum is the whole.
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import tomllib

try:
    import numpy as np
except ImportError as missing:
    print(f"drift_sessions: {missing}; install python3-numpy", file=sys.stderr)
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/reference/dose"), str(ROOT / "tests/apps")]
from exact_shapes import ball, figures, rod, write_stl  # noqa: E402
from tg43_numpy import Source  # noqa: E402

SPACING_MM, FINE_MM, STEP_MM = 0.6, 0.4, 2.5  # of points in the gland, for figures and for means; of catheters.csv
EXERCISE = ROOT / "config/exercises/14_second_fraction.toml"


class Case:
    def __init__(self, brachy, number, work):
        random = np.random.default_rng(4900 + number)
        self.brachy, self.number, self.work, self.faults = brachy, number, work, []
        self.middle, self.radius = random.uniform(-3, 3, 3), random.uniform(16, 19)
        write_stl(work / "gland.stl", ball(self.radius, self.middle))
        write_stl(work / "urethra.stl", rod(3.0, self.middle, 24.0))
        write_stl(work / "rectum.stl", rod(11.0, self.middle + [0, -self.radius - 14, 0], 30.0))
        origin = [float(self.middle[0] - 30), float(self.middle[1] - 30), float(self.middle[2] - self.radius - 40)]
        (work / "scene.toml").write_text(
            f'name = "case"\n[tissue]\nmesh = "gland.stl"\npoints = 2000\n[template]\norigin_mm = {origin}\n'
            '[implant]\nkind = "hdr"\nmax_catheters = 6\n[needle]\ncount = 6\n[dose]\nprescription_gy = 13.5\n'
            f'[plan]\nfile = "plan.toml"\n[noise]\non = true\nseed = {int(random.integers(1, 1 << 40))}\n'
            'drift_mm = 1.8\ntemplate_play_mm = 0\ntremor_mm = 0\nstop_s = 0\n'
            '[[structure]]\nname = "urethra"\nfile = "urethra.stl"\n'
            '[[structure]]\nname = "rectum"\nfile = "rectum.stl"\n')
        self.bounds = tomllib.loads(EXERCISE.read_text())["passes"]
        (work / "exercise.toml").write_text('name = "drift"\nasks = "a"\nscene = "scene.toml"\n[passes]\n' + "".join(
            f"{key} = {limit}\n" for key, limit in self.bounds.items() if key != "organ_passes_at_most"))

    def call(self, *arguments, codes=(0,)):
        done = subprocess.run([self.brachy, *map(str, arguments)], capture_output=True, text=True, cwd=self.work,
                              check=False)
        if done.returncode not in codes:
            raise RuntimeError(f"session {self.number}: brachy {' '.join(map(str, arguments))}: {done.stderr[-300:]}")
        return done.returncode, done.stdout

    def expect(self, holds, what):
        if not holds:
            self.faults.append(f"session {self.number}: {what}")

    def fly(self, way, name):
        with open(self.work / f"{name}.csv", "w", newline="") as file:
            csv.writer(file).writerows(way)
        self.call("replay", f"{name}.csv", "--offline", "--config", "scene.toml", "--session", name)
        code, text = self.call("score", name, "--exercise", "exercise.toml", "--force", codes=(0, 1))
        courses = {}
        with open(self.work / name / "catheters.csv") as rows:
            for row in csv.DictReader(rows):
                courses.setdefault(int(row["needle"]), []).append([float(row[k]) for k in
                                                                   ("x", "y", "z", "rest_x", "rest_y", "rest_z")])
        return code, text, json.loads((self.work / name / "hdr_report.json").read_text()), {
            n: np.array(points) for n, points in courses.items()}

    def gy(self, dwells, spacing=SPACING_MM):
        """In the gland."""
        box = [np.arange(-self.radius, self.radius, spacing) + spacing / 3] * 3
        p = np.stack(np.meshgrid(*box, indexing="ij"), -1).reshape(-1, 3)
        points = p[np.linalg.norm(p, axis=1) <= self.radius] + self.middle
        rate = sum(seconds * self.source.rate(self.outside(points - at, axis) + at, at, axis)
                   for at, axis, seconds in dwells if seconds > 0)
        return rate * 0.01 / 3600 * self.plan["source_strength_u"]

    def figures(self, dwells):
        return figures(self.gy(dwells), SPACING_MM**3, self.plan["prescription_gy"])

    def mean_gy(self, dwells):
        return np.mean(self.gy(dwells, FINE_MM))

    def outside(self, p, axis):
        """Inside the source's capsule the dose is that on its surface, outwards from its middle."""
        z = p @ axis
        y = np.linalg.norm(p - z[:, None] * axis, axis=1)
        deep = np.maximum(np.abs(z) / (self.capsule[0] / 2), y / (self.capsule[1] / 2))
        return p / np.clip(deep, 1e-6, 1)[:, None]

    def dwells(self, course_of, numbered=False):
        """Middle, axis and seconds of each dwell along the points of each catheter, from the tip backwards."""
        for c, catheter in enumerate(self.plan["catheter"]):
            points = course_of(c)
            for i, seconds in enumerate(catheter["dwell_s"]):
                at = (self.plan["tip_offset_mm"] + i * self.plan["step_mm"]) / STEP_MM
                k = min(int(at), len(points) - 2)
                axis = points[k] - points[k + 1]
                dwell = points[k] + (at - k) * (points[k + 1] - points[k]), axis / np.linalg.norm(axis), seconds
                yield (c, dwell) if numbered else dwell

    def judge_dose(self, name, report, courses, planned):
        def line(tip):
            return np.array([tip - [0, 0, STEP_MM * k] for k in range(60)])

        for what, of in (("plan", lambda c: line(planned[c])), ("delivered", lambda c: courses[c][:, 3:])):
            true, seen = self.figures(self.dwells(of)), report["dose"][what]["prostate"]
            self.expect(abs(seen["v100_percent"]["value"] - true["V100"]) <= 0.3,
                        f"{name}, {what}: V100 {seen['v100_percent']['value']:.2f}, by numpy {true['V100']:.2f}")
            percent = 100 * true["D90"] / self.plan["prescription_gy"]
            self.expect(abs(seen["d90_percent"]["value"] / percent - 1) <= 0.01,
                        f"{name}, {what}: D90 {seen['d90_percent']['value']:.2f} %, by numpy {percent:.2f}")
        sums = 0
        for c, one in enumerate(report["catheters"]):
            dwells = [d for k, d in self.dwells(lambda n: courses[n][:, 3:], numbered=True) if k == c]
            true, seen = self.mean_gy(dwells), one["mean_gy"]["prostate"]
            self.expect(abs(seen / true - 1) <= 0.05, f"{name}: catheter {c} gives {seen:.3f} Gy, by numpy {true:.3f}")
            sums += seen
        whole = report["dose"]["delivered_mean_gy"]["prostate"]
        self.expect(abs(sums / whole - 1) < 1e-9, f"{name}: catheters give {sums} Gy together, and {whole}")

    def run(self):
        self.call("plan", "--generate", "--hdr", "--config", "scene.toml", "--out", "plan.toml", "--force")
        self.call("plan", "--config", "scene.toml", "--trajectory", "way.csv")
        self.plan = tomllib.loads((self.work / "plan.toml").read_text())
        text = tomllib.loads((ROOT / f"config/sources/{self.plan['source']}.toml").read_text())
        self.capsule = text["capsule_length_mm"], text["capsule_diameter_mm"]
        self.source = Source(ROOT / f"config/sources/{self.plan['source']}.toml")
        with open(self.work / "way.csv") as file:
            way = list(csv.reader(file))
        z, needle = way[0].index("m23"), way[0].index("needle")
        planned = {int(row[needle]): np.array([float(row[way[0].index(k)]) for k in ("m03", "m13", "m23")])
                   for row in way[1:]}
        code, text, report, courses = self.fly(way, "left")
        off = np.array([courses[n][0, :3] - planned[n] for n in sorted(courses)])
        drift = off[0, 2]
        self.expect(len(off) == len(planned) and np.abs(off - [0, 0, drift]).max() < 1e-6,
                    f"the catheters have not drifted together along themselves: {off}")
        bound = self.bounds["tip_depth_error_mm_at_most"]
        self.expect((code == 1) == (abs(drift) > bound), f"a drift of {drift:.2f} mm: exit code {code}\n{text}")
        self.judge_dose("left", report, courses, planned)
        if abs(drift) > 2.5:  # smaller ones need not be named
            named = [f for f in report["findings"] if f["cause"] == "depth"]
            self.expect(named and named[0]["catheters"] in ([], sorted(planned)) and
                        f"{abs(drift):.1f} mm too {'shallow' if drift < 0 else 'deep'}" in named[0]["text"],
                        f"a drift of {drift:.2f} mm is not named: {report['findings']}")
        corrected = [way[0]] + [[*row[:z], repr(float(row[z]) - drift), *row[z + 1:]] for row in way[1:]]
        code, text, report, courses = self.fly(corrected, "corrected")
        self.expect(code == 0, f"corrected by {-drift:.2f} mm: exit code {code}\n{text}")
        self.expect(not [f for f in report["findings"] if f["cause"] == "depth"], f"corrected: {report['findings']}")
        self.judge_dose("corrected", report, courses, planned)
        return drift, self.faults


def main():
    brachy = str(pathlib.Path(sys.argv[1]).resolve())
    count, first = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((2, 2), (3, 0)))
    wrong = 0
    for number in range(first, first + count):
        with tempfile.TemporaryDirectory() as work:
            drift, faults = Case(brachy, number, pathlib.Path(work)).run()
        wrong += bool(faults)
        print("\n".join([f"session {number}: drift {drift:+.2f} mm", *faults]), flush=True)
    print(f"drift_sessions: {count - wrong} of {count} sessions are right")
    return 1 if wrong else 0


sys.exit(main())
