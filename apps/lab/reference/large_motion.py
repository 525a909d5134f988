"""The scenes of tests/reference/large_motion: neo-Hookean tissue under motions and forces of 1 to 8 mm.

Two mesh levels are solved where the second is affordable, and the finest that reaches the most load levels is stored.
All load levels of a scene are in one file. What is kept, all of it small text:

  field.csv        x,y,z, then dx,dy,dz of each load level, named by it (dx2,dy2,dz2,dx4,...): points of the gland
  landmarks.csv    (shafts and spheres) x,y,z,dx,dy,dz: points of the axis, with the displacement of the last level
  forces.csv       (forces) level,x,y,z,fx,fy,fz,core_mm: the dead body forces of each level, see forces.py
  levels.csv       one row a load level: the needle's force on the tissue, how far the linear solution and the other
                   mesh level are from what is stored
  convergence.csv  one row a mesh level
"""
import csv

import numpy as np

import calculix
import forces
import problem
import stored
import tet_mesh
from scene import LEVELS, Blob, UserError, load_scene
from solution import Solution, difference

FOLDER = "large_motion"


def names(root):
    """The scenes' names, sorted."""
    return sorted(file.parent.name for file in (root / FOLDER).glob("*/scene.toml"))


class Motion(Solution):
    """A rigid needle moved by the amplitudes of one run; one that diverges counts as far as it came."""

    def solve(self, scene, timeout_s):
        self.posed.reaction_nodes = tuple(problem.needle_nodes(self.posed.mesh, scene))
        self.posed.accepts_less = True
        fields = super().solve(scene, timeout_s)
        # The solved part is a half or a quarter of the body; across its planes the needle's force vanishes.
        whole = 2 ** len(scene.symmetry) * ~np.isin(list("xyz"), scene.symmetry)
        reached = float(np.linalg.norm(scene.load.displacement)) * np.array(scene.amplitudes)
        reactions = calculix.read_reactions(self.work / f"{self.name}.dat")
        self.levels = [
            {"level": f"{mm:.6g}", **{f"force_{axis}_n": f for axis, f in zip("xyz", whole * reaction)}}
            for mm, reaction, _ in zip(reached, reactions, fields)
        ]
        return fields

    def linear_levels(self, scene, timeout_s):
        """Displacements at the points of the linear solution, one for each level."""
        u = self.linear(timeout_s)
        return [share * u for share, _ in zip(scene.amplitudes, self.levels)]


class Insertion(Solution):
    """The dead forces of an insertion or a withdrawal, at full load."""

    def solve(self, scene, timeout_s):
        fields = super().solve(scene, timeout_s)
        self.levels = [{"level": "1", "force_z_n": float(sum(blob.force[2] for blob in scene.load.blobs))}]
        self.blobs = [scene.load.blobs]
        return fields

    def linear_levels(self, scene, timeout_s):
        return [self.linear(timeout_s)]


class Indentation(Solution):
    """One dead force around a point for each level, with the core that displaces the point by the level's name in the
    linear solution on this mesh; one run a level."""

    def solve(self, scene, timeout_s):
        mesh, at, up = self.posed.mesh, scene.load.tip, np.array([0.0, 0, 1])
        quadrature = forces.Quadrature(mesh)
        green = self._green(at, timeout_s)
        probe = tet_mesh.Locator(mesh, at[None])
        self.cost, self.decks = calculix.Cost(0.0, 0.0, 0.0), []
        self.levels, self.blobs, self.linears, fields = [], [], [], []
        for displacement, force in scene.load.indentations:
            core = forces.core_for(quadrature, green, at, force, displacement)
            blob = Blob(at, force * up, core)
            self.posed.forces = quadrature.nodal_forces([blob])
            name = f"{self.name}-{displacement:g}"
            (linear,), _ = calculix.solve(problem.linearised(self.posed), self.work, name + "-linear", timeout_s)
            (u,), cost = calculix.solve(self.posed, self.work, name, timeout_s)
            self.cost = calculix.Cost(
                self.cost.wall_s + cost.wall_s, self.cost.cpu_s + cost.cpu_s, max(self.cost.memory_mb, cost.memory_mb)
            )
            self.decks.append(name)
            self.blobs.append([blob])
            self.linears.append(linear)
            fields.append(u)
            self.levels.append(
                {
                    "level": f"{displacement:g}",
                    "force_z_n": force,
                    "core_mm": core,
                    "linear_at_point_mm": float(probe.evaluate(linear)[0, 2]),
                    "at_point_mm": float(probe.evaluate(u)[0, 2]),
                }
            )
        return fields

    def _green(self, at, timeout_s):
        """z displacements (nodes) of a unit point force along z at a point of the linear body."""
        mesh = self.posed.mesh
        locator = tet_mesh.Locator(mesh, at[None])
        self.posed.forces = {
            int(node): [0.0, 0.0, float(share)] for node, share in zip(locator.tets[0], locator.shape[0])
        }
        (u,), _ = calculix.solve(problem.linearised(self.posed), self.work, self.name + "-green", timeout_s)
        return u[:, 2]

    def linear_levels(self, scene, timeout_s):
        return [self.at_points(u) for u in self.linears]


KINDS = {"shaft": Motion, "force": Insertion, "indentation": Indentation}


def regenerate(folder, work, timeout_s):
    """Solves the levels up to scene.finest and stores the finest of those that reached the most load levels; False if
    the last load level was not reached or the levels differ by more than 5 %."""
    scene = load_scene(folder)
    points, _ = stored.evaluation_points(scene)
    solutions = []
    for level in LEVELS:
        try:
            solutions.append(KINDS[scene.load.kind](scene, level, points, work, timeout_s))
        except UserError as error:
            if not solutions:
                raise
            print(f"{'':24} {level} is left out: {error}", flush=True)
            break
        if level == scene.finest:
            break
    rows = [{**solution.row, "load_levels": len(solution.levels)} for solution in solutions]
    kept = max(reversed(solutions), key=lambda solution: len(solution.levels))
    levels = kept.levels
    for i, linear in enumerate(kept.linear_levels(scene, timeout_s)):
        levels[i].update(mesh=kept.level, **_compare(linear, kept.displacements[i], "linear"))
        others = [s for s in solutions if s is not kept and len(s.levels) > i]
        coarser = _compare(others[-1].displacements[i], kept.displacements[i], "mesh") if others else {}
        levels[i].update(coarser or {"rel_l2_mesh": "", "max_mm_mesh": ""})
        print(f"{'':24} " + ", ".join(f"{k} {_digits(v)}" for k, v in levels[i].items()), flush=True)
    _write(folder, scene, points, kept, rows)
    complete = scene.load.kind != "shaft" or len(levels) == len(scene.amplitudes)
    return complete and (levels[-1]["rel_l2_mesh"] or 0) < 0.05


def _compare(u, reference, what):
    return {
        f"rel_l2_{what}": difference(u, reference),
        f"max_mm_{what}": float(np.linalg.norm(u - reference, axis=1).max()),
    }


def _digits(value):
    return f"{value:.4g}" if isinstance(value, float) else value


def _write(folder, scene, points, kept, rows):
    # Four levels are written to 1 µm, for their size.
    digits = 5 if len(kept.levels) == 1 else 3
    labels = [row["level"] for row in kept.levels]
    with open(folder / "field.csv", "w") as out:
        out.write("x,y,z," + ",".join(f"d{axis}{label}" for label in labels for axis in "xyz") + "\n")
        for point, u in zip(points, np.hstack(kept.displacements)):
            u = np.round(u, digits) + 0.0  # no −0
            out.write(",".join([f"{v:.4f}" for v in point] + [f"{v:.{digits}f}" for v in u]) + "\n")
    if scene.load.kind == "shaft":
        stored.write_landmarks(folder, scene)
    else:
        with open(folder / "forces.csv", "w") as out:
            out.write("level,x,y,z,fx,fy,fz,core_mm\n")
            for label, blobs in zip(labels, kept.blobs):
                for blob in blobs:
                    values = ",".join(f"{v + 0.0:.9g}" for v in (*blob.at, *blob.force, blob.core))
                    out.write(f"{label},{values}\n")
    _write_table(folder / "levels.csv", kept.levels)
    _write_table(folder / "convergence.csv", rows)


def _write_table(file, rows):
    with open(file, "w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(rows[0])
        for row in rows:
            table.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in row.values()])


def _read_table(file):
    with open(file, newline="") as table:
        return list(csv.DictReader(table))


def recheck(folder, level, work, timeout_s):
    """Solves a mesh level again and compares its last load level with the stored one. The same deck must give the same
    numbers as far as they are written; another mesh must be as near as the stored coarse one, times 1.5."""
    scene = load_scene(folder)
    try:
        field = np.loadtxt(folder / "field.csv", delimiter=",", skiprows=1)
        levels, rows = _read_table(folder / "levels.csv"), _read_table(folder / "convergence.csv")
    except OSError as error:
        raise UserError(f"{folder.name}: nothing stored yet ({error}); run without --level first") from error
    solution = KINDS[scene.load.kind](scene, level, field[:, :3], work, timeout_s)
    at = min(len(levels), len(solution.levels)) - 1
    found = difference(solution.displacements[at], field[:, 3 + 3 * at : 6 + 3 * at])
    decks = {row["deck_sha256"] for row in rows if row["level"] == levels[at]["mesh"]}
    if solution.row["deck_sha256"] in decks:
        limit, what = 1e-3, "the same deck"
    else:
        limit, what = 1.5 * float(levels[at]["rel_l2_mesh"] or 0.02), "another mesh"
    agrees = found <= limit
    print(
        f"{'agrees' if agrees else 'DISAGREES'}: {scene.name} {level}, load level {levels[at]['level']}: {found:.2e} "
        f"(≤ {limit:.2e}) from the stored field, {what}",
        flush=True,
    )
    return agrees
