#!/usr/bin/python3
"""Checks the solver set-up (gmsh mesh, C3D10, deck, reading back) against closed forms.

  uniaxial      a block stretched along z, sides free: exact, to the digits ccx prints
  neo-Hookean   the same block stretched by a quarter, large displacement: the lateral stretch at which its
                sides are free
  kelvin        a point force in a block that carries Kelvin's displacement on its faces
  held kelvin   the same block with its faces held: how far a finite box is from the infinite medium (told, not judged)
  blob          a small dead body force of forces.py, spread over 6 mm, in neo-Hookean tissue, in a block that carries
                the regularised Kelvin solution on its faces
  rigid sphere  the needle's boundary condition: a rigid ball moved in a block that carries the closed form on its faces
                (the scenes' own mesh generator, boundary conditions and evaluation)

examples:
  apps/lab/reference/check.py                 # all, ν 0.45 and 0.49; about two minutes
  apps/lab/reference/check.py --only uniaxial

Exit codes: 0 all within tolerance, 1 some are not, 2 something is missing.
"""
import argparse
import pathlib
import sys
import tempfile

import numpy as np
from scipy.optimize import brentq

import forces
import kelvin as regularised
import problem
import tet_mesh
from calculix import Material, Problem, solve
from scene import Blob, Load, Scene, UserError

MU = 5e-3          # N/mm²; the closed forms are linear in it
POISSON = (0.45, 0.49)


def box_geo(name, low, extent, size, more=""):
    return (f'// {name}\nSetFactory("OpenCASCADE");\nGeneral.NumThreads = 1; Mesh.RandomSeed = 1;\n'
            "Mesh.ElementOrder = 2; Mesh.MshFileVersion = 2.2; Mesh.SaveAll = 1;\n"
            "Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0;\n"
            f"Box(1) = {{{', '.join(map(str, low))}, {', '.join(map(str, extent))}}};\n{more}"
            f'Field[1] = MathEval; Field[1].F = "{size}"; Background Field = 1;\n')


def kelvin(x, force, nu, mu=MU):
    """Displacement (n×3) at x (n×3) of a force (3, N) at the origin of an infinite medium."""
    r = np.linalg.norm(x, axis=1)[:, None]
    return ((3 - 4 * nu) * force + x * (x @ force)[:, None] / r ** 2) / (16 * np.pi * mu * (1 - nu) * r)


def rigid_sphere(x, radius, moved, nu):
    """Displacement (n×3) around a bonded rigid sphere moved by `moved` (3): Kelvin plus the potential dipole that makes
    it constant on the sphere. With c1 (3 − 4ν)I/r + c1 xxᵀ/r³ + c2 (I/r³ − 3xxᵀ/r⁵): c2 = c1 a²/3,
    c1 = 3a/(10 − 12ν)."""
    r = np.linalg.norm(x, axis=1)[:, None]
    c1 = 3 * radius / (10 - 12 * nu)
    c2 = c1 * radius ** 2 / 3
    along = x * (x @ moved)[:, None]
    return c1 * ((3 - 4 * nu) * moved / r + along / r ** 3) + c2 * (moved / r ** 3 - 3 * along / r ** 5)


def relative_l2(u, exact):
    return np.linalg.norm(u - exact) / np.linalg.norm(exact)


def on_faces(nodes, faces):
    """Rows of nodes on any of the planes (axis, position)."""
    return np.flatnonzero(np.any([np.abs(nodes[:, k] - at) < 1e-7 for k, at in faces], axis=0))


def lateral_stretch(stretch, nu):
    """Of a neo-Hookean bar, W = μ/2 (Ī1 − 3) + κ/2 (J − 1)²: where dW/dλt = 0. Only κ/μ matters."""
    bulk = 2 * (1 + nu) / (3 * (1 - 2 * nu))

    def slope(t):
        j, square = stretch * t * t, stretch ** 2 + 2 * t * t
        dj = 2 * stretch * t
        return (4 * t * j ** (-2 / 3) - 2 / 3 * j ** (-5 / 3) * dj * square) / 2 + bulk * (j - 1) * dj
    return brentq(slope, 0.5, 1.5, xtol=1e-14)


def uniaxial(work, nu):
    """One octant: symmetry on three faces, +z moved, two free. The displacement is linear, so in the elements' span."""
    mesh = tet_mesh.build(box_geo("uniaxial", (0, 0, 0), (10, 12, 14), "3"), work, "uniaxial")
    results = []
    for label, nonlinear, strain, tolerance in (("uniaxial", False, 0.01, 2e-6),  # ccx prints seven digits
                                                ("neo-Hookean", True, 0.25, 2e-5)):  # and iterates to a tolerance
        lateral = lateral_stretch(1 + strain, nu) - 1 if nonlinear else -nu * strain
        prescribed = {}
        for k in range(3):
            for node in on_faces(mesh.nodes, [(k, 0)]):
                prescribed.setdefault(int(node), [None] * 3)[k] = 0.0
        for node in on_faces(mesh.nodes, [(2, 14)]):
            prescribed.setdefault(int(node), [None] * 3)[2] = strain * 14
        block = {"BLOCK": (np.arange(len(mesh.tets)), Material(MU, nu, nonlinear))}
        (u,), _ = solve(Problem(mesh, block, prescribed, nonlinear=nonlinear), work, "uniaxial")
        exact = mesh.nodes * [lateral, lateral, strain]
        results.append((label, f"largest error / largest displacement, {len(mesh.nodes)} nodes",
                        np.abs(u - exact).max() / np.abs(exact).max(), tolerance))
    return results


def point_force(work, nu):
    """A quarter of a block of 60 mm, the force at a node in its middle; errors over 4 mm < r < 25 mm."""
    half, h = 30, 0.35
    size = f"{h}+0.22*sqrt(x^2+y^2+z^2)"
    geo = box_geo("kelvin", (0, 0, -half), (half, half, half), size,
                  # two boxes meet at the origin, so a node lies there
                  f"Box(2) = {{0, 0, 0, {half}, {half}, {half}}};\n"
                  "all() = BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; };\n")
    mesh = tet_mesh.build(geo, work, "kelvin")
    force = np.array([0, 0, 0.1])
    origin = int(np.argmin(np.linalg.norm(mesh.nodes, axis=1)))
    if np.linalg.norm(mesh.nodes[origin]) > 1e-9:
        raise UserError("kelvin: no node at the origin")
    outer = on_faces(mesh.nodes, [(0, half), (1, half), (2, half), (2, -half)])
    r = np.linalg.norm(mesh.nodes, axis=1)
    near = (r > 4) & (r < 25)
    exact = kelvin(np.where(r[:, None] == 0, 1, mesh.nodes), force, nu)
    results = []
    for name, outside in (("kelvin", exact), ("held kelvin", np.zeros_like(exact))):
        prescribed = {}
        for k in (0, 1):
            for node in on_faces(mesh.nodes, [(k, 0)]):
                prescribed.setdefault(int(node), [None] * 3)[k] = 0.0
        for node in outer:
            prescribed[int(node)] = [float(v) for v in outside[node]]
        (u,), cost = solve(Problem(mesh, {"BLOCK": (np.arange(len(mesh.tets)), Material(MU, nu))}, prescribed,
                                   forces={origin: force / 4}), work, "kelvin")
        what = f"relative L2 over 4 < r < 25 mm, {len(mesh.nodes)} nodes, {cost.cpu_s:.0f} s"
        results.append((name, what, relative_l2(u[near], exact[near]), 0.01 if name == "kelvin" else None))
    return results


def body_force(work, nu):
    """A quarter of a block of 60 mm, a blob in its middle whose force is small enough for the solution to be linear."""
    half, core, force = 30, 6.0, np.array([0.0, 0, 1e-3])
    results = []
    for factor, tolerance in ((1.0, 0.01), (0.7, 0.005)):
        size = f"{factor}*(1.6+0.2*sqrt(x^2+y^2+z^2))"
        mesh = tet_mesh.build(box_geo("blob", (0, 0, -half), (half, half, 2 * half), size), work, "blob")
        spread = np.full(len(mesh.nodes), core ** 2)
        kernel = regularised.displacement(mesh.nodes, spread, np.zeros((1, 3)), np.zeros(1), nu)
        exact = kernel.reshape(-1, 3, 3) @ force / MU
        prescribed = {}
        for k in (0, 1):
            for node in on_faces(mesh.nodes, [(k, 0)]):
                prescribed.setdefault(int(node), [None] * 3)[k] = 0.0
        for node in on_faces(mesh.nodes, [(0, half), (1, half), (2, half), (2, -half)]):
            prescribed[int(node)] = [float(v) for v in exact[node]]
        nodal = forces.Quadrature(mesh).nodal_forces([Blob(np.zeros(3), force, core)])
        block = {"BLOCK": (np.arange(len(mesh.tets)), Material(MU, nu, True))}
        (u,), cost = solve(Problem(mesh, block, prescribed, nodal, nonlinear=True, first_increment=1.0,
                                   largest_increment=1.0), work, "blob")
        what = f"relative L2, sizes × {factor:g}, {len(mesh.nodes)} nodes, {cost.cpu_s:.0f} s"
        results.append(("blob", what, relative_l2(u, exact), tolerance))
    return results


def sphere(work, nu):
    """A scene whose shaft is as short as it can be, at the coarse scenes' sizes, with the closed form on the faces."""
    radius, moved = 2.0, np.array([0.0, 0, 1])
    scene = Scene("sphere", np.full(3, 60.0), ["-x", "+x", "-y", "+y", "-z", "+z"], MU, nu, np.zeros(3),
                  np.array([20.0, 18, 16]), MU, radius,
                  Load("shaft", np.array([0.0, 0, radius]), moved, np.array([0.0, 0, -radius]), 3.0),
                  ["x", "y"], [], False, [1.0], 1.0, 3.5)
    results = []
    for factor, tolerance in ((1.0, 0.02), (0.7, 0.01)):
        mesh = tet_mesh.build(tet_mesh.geo_text(scene, factor), work, "sphere")
        posed = problem.pose(mesh, scene)
        outer = on_faces(mesh.nodes, [(k, side * 30) for k in range(3) for side in (-1, 1)])
        for node, u in zip(outer, rigid_sphere(mesh.nodes[outer], radius, moved, nu)):
            posed.prescribed[int(node)] = [float(v) for v in u]
        (u,), cost = solve(posed, work, "sphere")
        points = np.random.default_rng(1).uniform(-18, 18, (4000, 3))
        points = points[scene.in_gland(points) & (scene.needle_distance(points) > radius)]
        folded, signs = problem.fold(points, scene)
        found = tet_mesh.Locator(mesh, folded).evaluate(u) * signs
        what = f"relative L2 in the gland, sizes × {factor:g}, {len(mesh.nodes)} nodes, {cost.cpu_s:.0f} s"
        results.append(("rigid sphere", what, relative_l2(found, rigid_sphere(points, radius, moved, nu)), tolerance))
    return results


CHECKS = {"uniaxial": uniaxial, "kelvin": point_force, "blob": body_force, "sphere": sphere}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=CHECKS, help="one check instead of all")
    parser.add_argument("--keep", metavar="DIR", help="keep decks, meshes and logs here")
    options = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory(prefix="brachy-check-") as scratch:
        work = pathlib.Path(options.keep or scratch)
        work.mkdir(parents=True, exist_ok=True)
        for name in [options.only] if options.only else CHECKS:
            for nu in POISSON:
                for label, what, value, tolerance in CHECKS[name](work, nu):
                    verdict = "told" if tolerance is None else "pass" if value <= tolerance else "FAIL"
                    good &= verdict != "FAIL"
                    limit = "" if tolerance is None else f" (≤ {tolerance:g})"
                    print(f"{verdict}  {label:12} ν {nu:.2f}  {value:.2e}{limit}  {what}", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"check: {error}", file=sys.stderr)
        sys.exit(2)
