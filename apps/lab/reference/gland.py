#!/usr/bin/python3
"""Solves the two scenes of tests/reference/gland with CalculiX: a transrectal probe pressed against the gland, and a
needle that moves the gland on its ligaments.

A block of 96 mm, ν = 0.49, μ = 6 kPa, all faces held, and the gland's surface, an ellipsoid of 25 × 20 × 22.5 mm
semi-axes, in its middle; linear elasticity, quarters by symmetry.

  probe   a rigid cylinder of 14 mm radius (10 mm and a rectal wall of 4 mm) along z pushes the gland's back by 3 and
          6 mm along +y. Nodes of the gland's surface do not come into it; they are pushed, not pulled, and slide.
  motion  3.96 N around the pole (0, 0, −22.5) along +z as a dead force (forces.py) whose core displaces the pole by
          6 mm, and the block on a spring along z, so soft that block and spring together give as the ligaments: the
          gland's surface, moved together, takes 0.7 N/mm.

Stored: probe.csv and motion.csv with x,y,z and the displacements of each level at points of the gland, and levels.csv
with forces, and how far two mesh levels differ.

examples:
  apps/lab/reference/gland.py            # solve again and store, two minutes
  apps/lab/reference/gland.py --check    # solve the coarse level again, compare with what is stored

Exit codes: 0 done, 1 disagrees, 2 a program is missing.
"""
import argparse
import csv
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

import calculix
import forces
import problem
import tet_mesh
from scene import LEVELS, Blob, Load, Scene, UserError

ROOT = pathlib.Path(__file__).resolve().parents[3] / "tests" / "reference" / "gland"
SEMI_AXES = np.array([25.0, 20.0, 22.5])
RADIUS = 14.0  # mm, of the probe with the rectal wall
DEPTHS = (3.0, 6.0)  # mm
LIGAMENTS = 0.7  # N/mm, of the whole gland along z
PRESSED = (6.0, 0.3 * 6 + 0.06 * 36)  # mm, N: the capsule's law
LOOSE = 0.02  # mm: nodes that come so far into the probe are pushed out of it
ON_SURFACE = 1e-4  # mm


def scene_of(name, tip, symmetry, needle_mm):
    load = Load("indentation", np.array(tip), np.zeros(3), np.array(tip), 3.0)
    return Scene(name, np.full(3, 96.0), ["-x", "+x", "-y", "+y", "-z", "+z"], 0.006, 0.49, np.zeros(3), SEMI_AXES,
                 0.006, 2.0, load, symmetry, [], False, [1.0], needle_mm, 5.0, mesh_growth=0.12)


def evaluation_points():
    """Points of the gland on a grid of 5 mm, one or more mm inside its surface (n×3)."""
    axes = [np.arange(-25.0, 25.1, 5.0)] * 3
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points[((points / (SEMI_AXES - 1)) ** 2).sum(axis=1) < 1]


class Pressed:
    """One mesh of the scene `probe`: which nodes the cylinder pushes is found by an active set."""

    def __init__(self, level, work):
        self.scene = scene_of("probe", [0, -20, 0], ["x", "z"], 1.6)
        self.work, self.name = work, f"probe-{level}"
        self.mesh = tet_mesh.build(tet_mesh.geo_text(self.scene, LEVELS[level]), work, self.name)
        q = np.sqrt(((self.mesh.nodes / SEMI_AXES) ** 2).sum(axis=1))
        back = (np.abs(q - 1) * SEMI_AXES.min() < ON_SURFACE) & (self.mesh.nodes[:, 1] < -5)
        self.nodes = np.flatnonzero(back)
        self.posed = problem.pose(self.mesh, self.scene)

    def solve(self, depth):
        """Displacements (nodes×3) and the force on the tissue along y, N."""
        X = self.mesh.nodes[self.nodes]
        axis = np.array([0, -SEMI_AXES[1] - RADIUS + depth])
        u = np.zeros((len(self.mesh.nodes), 3))
        active = RADIUS - np.linalg.norm(X[:, :2] - axis, axis=1) > 0.5 * depth
        for round_ in range(25):
            away = X[:, :2] + u[self.nodes][:, :2] - axis
            normals = away / np.linalg.norm(away, axis=1)[:, None]
            gaps = RADIUS - ((X[:, :2] - axis) * normals).sum(axis=1)
            before, u = u, None
            u, reactions = self._linear(normals, gaps, active)
            inside = RADIUS - np.linalg.norm(X[:, :2] + u[self.nodes][:, :2] - axis, axis=1)
            pulled = active & (reactions < 0)
            entered = ~active & (inside > LOOSE)
            change = np.abs(u - before).max()
            force = 4 * (np.where(active, reactions, 0) * normals[:, 1]).sum()
            print(f"{self.name:14} {depth} mm, round {round_}: {active.sum()} nodes, {pulled.sum()} pulled, "
                  f"{entered.sum()} entered, moved {change:.3f} mm, {force:.3f} N", flush=True)
            if not entered.any() and not pulled.any() and change < 0.01:
                return u, force
            active = (active & ~pulled) | entered
        return u, force

    def _linear(self, normals, gaps, active):
        """With n·u = gap at the active nodes of the back: displacements, and the reaction of each along n."""
        text = calculix.deck_text(self.posed)
        cards, bounds = [], []
        for node, n, gap, on in zip(self.nodes, normals, gaps, active):
            if not on:
                continue
            cards.append(f"*NSET, NSET=N{node + 1}\n{node + 1}\n*TRANSFORM, NSET=N{node + 1}, TYPE=R\n"
                         f"{n[0]:.12g}, {n[1]:.12g}, 0, {-n[1]:.12g}, {n[0]:.12g}, 0")
            bounds.append(f"{node + 1}, 1, 1, {gap:.12g}")
            if abs(self.mesh.nodes[node, 0]) < 1e-7:  # the plane x = 0 of symmetry: the tangent is along x
                bounds.append(f"{node + 1}, 2, 2, 0")
            if abs(self.mesh.nodes[node, 2]) < 1e-7:
                bounds.append(f"{node + 1}, 3, 3, 0")
        pushed = {node + 1 for node, on in zip(self.nodes, active) if on}
        head, tail = text.split("*STEP\n*STATIC\n*BOUNDARY\n")
        held, rest = tail.split("*NODE PRINT", 1)
        held = "".join(line for line in held.splitlines(True) if int(line.split(",")[0]) not in pushed)
        sets = "*NSET, NSET=PUSHED\n" + "\n".join(str(node) for node in sorted(pushed))
        deck = (head + "\n".join(cards) + "\n" + sets + "\n*STEP\n*STATIC\n*BOUNDARY\n" + held + "\n".join(bounds)
                + "\n*NODE PRINT, NSET=ALL, GLOBAL=YES\nU\n*NODE PRINT, NSET=PUSHED, GLOBAL=YES\nRF\n*END STEP\n")
        u = run(deck, self.work, self.name, len(self.mesh.nodes))
        table = {}
        with open(self.work / f"{self.name}.dat") as lines:
            reading = False
            for line in lines:
                if line.lstrip().startswith("forces"):
                    reading = True
                elif reading and len(line.split()) == 4:
                    a = line.split()
                    table[int(a[0]) - 1] = np.array([float(v) for v in a[1:]])
        reactions = np.array([table[node][:2] @ n if node in table else 0.0
                              for node, n in zip(self.nodes, normals)])
        return u, reactions


def run(deck, work, name, nodes):
    """Runs one deck of a linear problem: displacements (nodes×3)."""
    (work / f"{name}.inp").write_text(deck)
    with open(work / f"{name}.ccx.log", "w") as log:
        code = subprocess.call(["nice", "-n", "19", "ccx", "-i", name], cwd=work, stdout=log, stderr=subprocess.STDOUT)
    if code != 0 or "*ERROR" in (work / f"{name}.ccx.log").read_text(errors="replace"):
        raise UserError(f"ccx failed on {name}; see {work / name}.ccx.log")
    return calculix.read_displacements(work / f"{name}.dat", nodes)[0]


def probe_levels(level, work, points):
    """For each depth: displacements at the points (n×3), and the row of levels.csv."""
    pressed = Pressed(level, work)
    folded, signs = problem.fold(points, pressed.scene)
    locator = tet_mesh.Locator(pressed.mesh, folded)
    out = []
    for depth in DEPTHS:
        u, force = pressed.solve(depth)
        out.append((locator.evaluate(u) * signs, {"scene": "probe", "level_mm": depth, "force_n": force}))
    return out


def motion_levels(level, work, points):
    """The same for the needle's force: one level."""
    scene = scene_of("motion", [0, 0, -22.5], ["x", "y"], 1.4)
    mesh = tet_mesh.build(tet_mesh.geo_text(scene, LEVELS[level]), work, f"motion-{level}")
    posed = problem.pose(mesh, scene)
    # What the walls allow: the gland's surface moved together.
    q = np.sqrt(((mesh.nodes / SEMI_AXES) ** 2).sum(axis=1))
    surface = np.flatnonzero(np.abs(q - 1) * SEMI_AXES.min() < ON_SURFACE)
    together = problem.pose(mesh, scene)
    for node in surface:
        together.prescribed[int(node)] = [0.0, 0.0, 1.0]
    together.reaction_nodes = tuple(surface)
    calculix.solve(together, work, f"motion-{level}-walls", 1800)
    walls = 4 * calculix.read_reactions(work / f"motion-{level}-walls.dat")[0][2]  # N/mm
    spring = 1 / (1 / LIGAMENTS - 1 / walls)
    # The needle's force, with the core of the capsule's law.
    at, quadrature = scene.load.tip, forces.Quadrature(mesh)
    locator = tet_mesh.Locator(mesh, at[None])
    posed.forces = {int(node): [0.0, 0.0, float(s)] for node, s in zip(locator.tets[0], locator.shape[0])}
    (u,), _ = calculix.solve(posed, work, f"motion-{level}-green", 1800)
    core = forces.core_for(quadrature, u[:, 2], at, PRESSED[1], PRESSED[0])
    posed.forces = quadrature.nodal_forces([Blob(at, np.array([0, 0, PRESSED[1]]), core)])
    (u,), _ = calculix.solve(posed, work, f"motion-{level}", 1800)
    folded, signs = problem.fold(points, scene)
    moved = tet_mesh.Locator(mesh, folded).evaluate(u) * signs + np.array([0, 0, PRESSED[1] / spring])
    row = {"scene": "motion", "level_mm": PRESSED[0], "force_n": PRESSED[1], "walls_n_per_mm": walls,
           "spring_n_per_mm": spring, "core_mm": core}
    return [(moved, row)]


def difference(u, reference):
    return float(np.linalg.norm(u - reference) / np.linalg.norm(reference))


def write(name, points, levels):
    with open(ROOT / f"{name}.csv", "w") as out:
        out.write("x,y,z," + ",".join(f"d{a}{row['level_mm']:g}" for _, row in levels for a in "xyz") + "\n")
        for values in np.hstack([points] + [u for u, _ in levels]):
            out.write(",".join(f"{v + 0.0:.4f}" for v in values) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="solve the coarse level again and compare")
    arguments = parser.parse_args()
    points = evaluation_points()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        rows, agrees = [], True
        for name, solve in (("probe", probe_levels), ("motion", motion_levels)):
            coarse = solve("coarse", work, points)
            if arguments.check:
                stored = np.loadtxt(ROOT / f"{name}.csv", delimiter=",", skiprows=1)
                for i, (u, row) in enumerate(coarse):
                    found = difference(u, stored[:, 3 + 3 * i:6 + 3 * i])
                    agrees &= found < 0.05
                    print(f"{'agrees' if found < 0.05 else 'DISAGREES'}: {name} {row['level_mm']:g} mm: {found:.2%}")
                continue
            finer = solve("medium", work, points)
            for (u, row), (before, other) in zip(finer, coarse):
                row["rel_l2_mesh"] = difference(before, u)
                row["force_mesh"] = other["force_n"] / row["force_n"] - 1
                print(row, flush=True)
                rows.append(row)
            ROOT.mkdir(exist_ok=True)
            write(name, points, finer)
        if rows:
            columns = ["scene", "level_mm", "force_n", "walls_n_per_mm", "spring_n_per_mm", "core_mm", "rel_l2_mesh",
                       "force_mesh"]
            with open(ROOT / "levels.csv", "w", newline="") as out:
                table = csv.DictWriter(out, columns, lineterminator="\n")
                table.writeheader()
                for row in rows:
                    table.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
        return 0 if agrees else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"gland: {error}", file=sys.stderr)
        sys.exit(2)
