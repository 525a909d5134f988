#!/usr/bin/python3
"""Solves the touches of tests/reference/lateral_touches with CalculiX: a thin needle that comes from outside and
presses sideways against the gland.

A block of 96 mm, ν = 0.49, μ = 6 kPa, all faces held, and the gland's surface, an ellipsoid of 25 × 20 × 22.5 mm
semi-axes, in its middle; linear elasticity. What is prescribed is in the folder's README.md.

examples:
  apps/lab/reference/lateral_touches.py                     # solve again and store, half an hour of one processor
  apps/lab/reference/lateral_touches.py --check             # solve the coarse level again, compare with what is stored
  apps/lab/reference/lateral_touches.py --check --case 2 4  # only these

Exit codes: 0 done, 1 disagrees, 2 a program is missing.
"""
import argparse
import csv
import dataclasses
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import calculix
import tet_mesh
from scene import LEVELS, UserError

ROOT = pathlib.Path(__file__).resolve().parents[3] / "tests" / "reference" / "lateral_touches"
SIZE = 96.0  # mm, of the block
SEMI_AXES = np.array([25.0, 20.0, 22.5])
MODULUS, POISSON = 0.006, 0.49  # N/mm²
RADIUS = 0.635  # mm, of the needle
MESH = 0.3  # mm, element size at the contact, level "coarse"
GROWTH = 0.32  # of the size, mm for each mm away from it
LARGEST = 16.0  # mm
TIP = 0.4  # of the size, at a tip that ends within the contact
STRETCH = 2.0  # elements are that much longer along the needle
NEAR = 0.2  # mm: nodes nearer than that to the needle, at rest, may be pushed
LOOSE = 0.005  # mm: nodes that come so far into the needle are pushed out of it
ON_SURFACE = 1e-4  # mm
COLUMNS = ["case", "tip_x_mm", "tip_y_mm", "tip_z_mm", "axis_x", "axis_y", "axis_z", "push_x", "push_y", "push_z",
           "depth_mm", "tip_past_mm", "force_x_n", "force_y_n", "force_z_n", "contact_from_mm", "contact_to_mm",
           "mesh_difference_percent"]
# A symmetric block's half is solved.
HALF = ["Box(4) = {-200, 0, -200, 400, 200, 400};",
        "body() = BooleanIntersection{ Volume{1}; Delete; }{ Volume{4}; Delete; };"]
ACCEPTED = 3.0  # %, the most that two mesh levels may differ


@dataclasses.dataclass
class Touch:
    """A needle that presses the surface at the place with the outward normal along `normal`. Its axis is the part of
    `along` that is tangent there; the tip is `past` mm past the place, which lies `depth` within the needle's front."""

    normal: tuple
    along: tuple
    depth: float  # mm
    past: float  # mm

    def __post_init__(self):
        n = np.array(self.normal, float)
        self.push = -n / np.linalg.norm(n)
        self.at = SEMI_AXES**2 * n / np.linalg.norm(SEMI_AXES * n)
        a = np.array(self.along, float)
        a -= (a @ self.push) * self.push
        self.axis = a / np.linalg.norm(a)
        self.across = np.cross(self.push, self.axis)
        self.tip = self.at + (self.depth - RADIUS) * self.push + self.past * self.axis
        # The surface rises from the place by curvature · t² / 2 along the axis.
        self.curvature = ((self.axis / SEMI_AXES) ** 2).sum() / np.linalg.norm(self.at / SEMI_AXES**2)
        half = np.sqrt(2 * (self.depth + NEAR) / self.curvature) + 1
        self.extent = (-half, min(half, self.past))  # of the nodes that may be pushed, along the axis from the place

    def is_symmetric(self):
        """The block mirrors in the plane of axis and push, which holds its middle."""
        return np.count_nonzero(np.abs(self.across) > 1e-12) == 1 and abs(self.at @ self.across) < 1e-9

    def deepest(self):
        """How deep the needle's front line lies in the gland at rest, at most up to its tip, mm."""
        if self.past >= 0:
            return self.depth
        at = self.tip + RADIUS * self.push  # the front of the tip; out along −push to the surface
        a, b, c = ((v / SEMI_AXES) @ (w / SEMI_AXES) for v, w in
                   ((self.push, self.push), (self.push, at), (at, at)))
        return float((b + np.sqrt(b * b - a * (c - 1))) / a)

    def frame(self):
        """3×3, rows: axis, across, push."""
        return np.array([self.axis, self.across, self.push])


SHAFT = 25.0  # mm, the tip lies that far past the place: well beyond the contact
CASES = [
    Touch((1, 0, 0), (0, 0, 1), 2.0, SHAFT),
    Touch((1, 0, 0), (0, 0, 1), 2.0, 4.0),
    Touch((0, -1, 0), (0, 0, 1), 3.0, SHAFT),
    Touch((0, -1, 0), (0, 0, 1), 1.5, 3.0),
    Touch((0, -1, 0), (1, 0, 0), 2.0, SHAFT),
    Touch((1, -1, 0), (0, 0, 1), 1.0, SHAFT),
    Touch((-1, -1, -0.5), (0.5, 0, 1), 2.5, 5.0),
    Touch((0, 0, -1), (1, 0, 0), 2.0, 3.0),
    Touch((0.8, 0, -0.6), (0, 0, 1), 3.0, -2.0),
    Touch((-0.3, 1, -0.4), (0.6, 0, 1), 1.5, SHAFT),
]


def geo_text(touch, factor):
    """The block and the gland's surface, on which the needle's footprint is drawn, as a .geo in the needle's frame and
    shortened along it: the elements are to be longer that way."""
    first, last = (t / STRETCH for t in touch.extent)
    curvature = touch.curvature * STRETCH**2
    low = [first, 0.0 if touch.is_symmetric() else -RADIUS, -0.5]
    size = [last - first, RADIUS - low[1], 1.0 + 0.6 * curvature * max(-first, last) ** 2]
    turn = Rotation.from_matrix(touch.frame()).as_rotvec()
    angle = np.linalg.norm(turn)
    turned = f"Rotate {{{{{_list(turn / angle)}}}, {{0, 0, 0}}, {angle:.15g}}} {{ Volume{{1, 2}}; }}" if angle else ""
    middle, reach = (first + last) / 2, (last - first) / 2
    along = f"({_beyond(f'x-({middle:.12g})', reach)})^2"
    across, up = f"({_beyond('y', 0.7 * RADIUS)})^2", f"(z-({curvature / 2:.12g})*x^2)^2"
    at_tip = f"(x-({last:.12g}))^2"
    finest, growth = MESH * factor, GROWTH * factor**0.5
    return "\n".join([
        "// written by apps/lab/reference/lateral_touches.py, lengths in mm",
        'SetFactory("OpenCASCADE");',
        "General.NumThreads = 1; Mesh.RandomSeed = 1;  // the same mesh every time",
        "Mesh.ElementOrder = 2; Mesh.HighOrderOptimize = 0; Mesh.Optimize = 1;",
        "Mesh.MshFileVersion = 2.2; Mesh.SaveAll = 1;",
        "Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0;",
        "Mesh.CharacteristicLengthFromCurvature = 0;",
        f"Box(1) = {{{_list([-SIZE / 2] * 3)}, {_list([SIZE] * 3)}}};",
        "Sphere(2) = {0, 0, 0, 1};",
        # The sphere's poles, which gmsh has on z, must not lie under the needle.
        *(["Rotate {{1, 0, 0}, {0, 0, 0}, Pi/2} { Volume{2}; }"] if abs(touch.push[2]) > 0.9 else []),
        f"Dilate {{{{0, 0, 0}}, {{{_list(SEMI_AXES)}}}}} {{ Volume{{2}}; }}",
        f"Translate {{{_list(-touch.at)}}} {{ Volume{{1, 2}}; }}",
        turned,
        f"Dilate {{{{0, 0, 0}}, {{{1 / STRETCH:.12g}, 1, 1}}}} {{ Volume{{1, 2}}; }}",
        *(HALF if touch.is_symmetric() else ["body() = {1};"]),
        f"Box(3) = {{{_list(low)}, {_list(size)}}};",
        "under() = BooleanIntersection{ Volume{2}; Delete; }{ Volume{3}; Delete; };",
        "all() = BooleanFragments{ Volume{body()}; Delete; }{ Volume{under()}; Delete; };",
        "Field[1] = MathEval;",
        f'Field[1].F = "{finest:.6g}+{growth:.6g}*sqrt({along}+{across}+{up})";',
        "Field[2] = MathEval;",
        f'Field[2].F = "{finest * TIP:.6g}+{growth:.6g}*sqrt({at_tip}+{across}+{up})";',
        f'Field[3] = MathEval; Field[3].F = "{LARGEST * factor:.6g}";',
        f"Field[4] = Min; Field[4].FieldsList = {{1, 3{', 2' if touch.past < SHAFT else ''}}}; Background Field = 4;",
    ]) + "\n"


def _beyond(value, reach):
    """How far |value| is beyond the reach, as gmsh's formula."""
    return f"(abs(abs({value})-{reach:.12g})+abs({value})-{reach:.12g})/2"


def _list(values):
    return ", ".join(f"{v:.12g}" for v in values)


class Pressed:
    """One mesh of a touch: which of the nodes near the needle it pushes is found by an active set."""

    def __init__(self, touch, level, work, name):
        self.touch, self.work, self.name = touch, work, name
        mesh = tet_mesh.build(geo_text(touch, LEVELS[level]), work, name)
        # The nodes stay in the needle's frame, where the push is along z.
        local = mesh.nodes * [STRETCH, 1, 1]
        nodes = local @ touch.frame() + touch.at
        on_surface = np.abs(np.sqrt(((nodes / SEMI_AXES) ** 2).sum(axis=1)) - 1) * SEMI_AXES.min() < ON_SURFACE
        gaps = front(touch, local[:, 1]) - local[:, 2]
        self.nodes = np.flatnonzero(on_surface & (local[:, 0] < touch.past + ON_SURFACE)
                                    & (np.abs(local[:, 1]) < RADIUS + ON_SURFACE) & (gaps > -NEAR))
        self.gaps, self.places, self.count = gaps[self.nodes], local[self.nodes], len(nodes)
        walls = np.flatnonzero(np.abs(nodes).max(axis=1) > SIZE / 2 - 1e-6)
        prescribed = {int(node): [0.0] * 3 for node in walls}
        if touch.is_symmetric():
            for node in np.flatnonzero(np.abs(local[:, 1]) < 1e-7):
                prescribed.setdefault(int(node), [None, 0.0, None])
        posed = calculix.Problem(tet_mesh.TetMesh(local, mesh.tets, mesh.volume_tags),
                                 {"TISSUE": (np.arange(len(mesh.tets)), calculix.Material(MODULUS, POISSON))},
                                 prescribed)
        near = "".join(f"{node + 1}\n" for node in self.nodes)
        head, tail = calculix.deck_text(posed).split("*STEP\n*STATIC\n")
        self.head = f"{head}*NSET, NSET=NEAR\n{near}*STEP\n*STATIC\n{tail.split('*NODE PRINT')[0]}"

    def press(self, pushed):
        """Begins with `pushed` (n, of the nodes near the needle). Returns which are pushed and the needle's force on
        each along the push, N."""
        for round_ in range(25):
            u, forces = self._linear(pushed)
            pulled = pushed & (forces < 0)
            entered = ~pushed & (self.gaps - u > LOOSE)
            if not pulled.any() and not entered.any():
                break
            pushed = (pushed & ~pulled) | entered
        print(f"{self.name:17} {self.count:6} nodes, {len(u):4} near, {pushed.sum():4} pushed, round {round_ + 1}, "
              f"{pulled.sum()} pulled, {entered.sum()} entered, {forces.sum():.4f} N", flush=True)
        return pushed, forces

    def _linear(self, pushed):
        """With u = gap along the push at the pushed nodes: displacement and force along it of each node near."""
        bounds = "".join(f"{node + 1}, 3, 3, {gap:.12g}\n"
                         for node, gap in zip(self.nodes[pushed], self.gaps[pushed]))
        deck = f"{self.head}{bounds}*NODE PRINT, NSET=NEAR\nU, RF\n*END STEP\n"
        (self.work / f"{self.name}.inp").write_text(deck)
        log = self.work / f"{self.name}.ccx.log"
        with open(log, "w") as out:
            code = subprocess.call(["nice", "-n", "10", "ccx", "-i", self.name], cwd=self.work, stdout=out,
                                   stderr=subprocess.STDOUT, env={**os.environ, "OMP_NUM_THREADS": "1"})
        if code != 0 or "*ERROR" in log.read_text(errors="replace"):
            raise UserError(f"ccx failed on {self.name}; see {log}")
        rows = [line.split() for line in (self.work / f"{self.name}.dat").read_text().splitlines()]
        table = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], float)
        if len(table) != 2 * len(self.nodes):
            raise UserError(f"{self.name}: ccx did not print all nodes; see {log}")
        u, forces = table[:len(self.nodes), 3], table[len(self.nodes):, 3]
        whole = 2 if self.touch.is_symmetric() else 1
        return u, np.where(pushed, whole * forces, 0.0)


def front(touch, across):
    """How far the needle's front comes along the push at an offset across it (n), from the place at rest, mm."""
    return touch.depth - RADIUS + np.sqrt(np.maximum(RADIUS**2 - across**2, 0))


def solve(number, levels, work):
    """The row of touches.csv, but for the difference of the meshes, by the last level; the force along the push by
    each level, N."""
    touch, forces, coarser, started = CASES[number - 1], [], None, time.monotonic()
    for level in levels:
        pressed = Pressed(touch, level, work, f"touch-{number}-{level}")
        if coarser is None:
            begin = (pressed.gaps > 0.4 * touch.depth) & (np.abs(pressed.places[:, 1]) < 0.7 * RADIUS)
        else:  # as the coarser mesh has it nearby; across, nodes count ten times as near
            scale = np.array([0.3, 1.0, 0.1])
            _, nearest = cKDTree(coarser[0] * scale).query(pressed.places * scale)
            begin = coarser[1][nearest]
        pushed, each = pressed.press(begin)
        coarser = pressed.places, pushed
        forces.append(each.sum())
    along = pressed.places[pushed & (each > 1e-3 * each.max()), 0] - touch.past
    print(f"case {number}: {forces[-1]:.4f} N, contact from {along.min():.1f} to {along.max():.1f} mm of the tip, half "
          f"as wide as {np.abs(pressed.places[pushed, 1]).max():.2f} mm, "
          f"{time.monotonic() - started:.0f} s", flush=True)
    return [number, *touch.tip, *touch.axis, *touch.push, touch.deepest(), touch.past, *(forces[-1] * touch.push),
            along.min(), along.max()], forces


def read_rows():
    """case → row of touches.csv, as numbers."""
    try:
        with open(ROOT / "touches.csv", newline="") as table:
            next(table)
            return {int(row[0]): [int(row[0]), *map(float, row[1:])] for row in csv.reader(table)}
    except OSError:
        return {}


def write_rows(rows):
    ROOT.mkdir(exist_ok=True)
    with open(ROOT / "touches.csv", "w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(COLUMNS)
        for _, row in sorted(rows.items()):
            table.writerow([row[0]] + [f"{round(v, 7) + 0.0:.7g}" for v in row[1:-1]] + [f"{row[-1]:.2f}"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="solve the coarse level again and compare")
    parser.add_argument("--case", metavar="N", type=int, nargs="+", help="only these; the others stay as stored",
                        choices=range(1, len(CASES) + 1))
    parser.add_argument("--work", metavar="DIR", help="keep meshes, decks and logs here")
    arguments = parser.parse_args()
    cases = arguments.case or list(range(1, len(CASES) + 1))
    with tempfile.TemporaryDirectory(prefix="brachy-reference-") as scratch:
        work = pathlib.Path(arguments.work or scratch)
        work.mkdir(parents=True, exist_ok=True)
        rows, good = read_rows(), True
        for case in cases:
            if arguments.check:
                if case not in rows:
                    raise UserError(f"case {case} is not stored yet; run without --check first")
                _, (force,) = solve(case, ["coarse"], work)
                off = abs(force / np.linalg.norm(force_of(rows[case])) - 1)
                print(f"{'agrees' if off < ACCEPTED / 100 else 'DISAGREES'}: case {case}: {off:.2%}", flush=True)
            else:
                row, (coarse, finer) = solve(case, ["coarse", "medium"], work)
                off = abs(coarse / finer - 1)
                rows[case] = [*row, 100 * (coarse / finer - 1)]
                write_rows(rows)
            good &= off < ACCEPTED / 100
    return 0 if good else 1


def force_of(row):
    """The needle's force on the tissue (3, N) in a row of touches.csv."""
    return np.array(row[COLUMNS.index("force_x_n"):COLUMNS.index("force_z_n") + 1])


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"lateral_touches: {error}", file=sys.stderr)
        sys.exit(2)
