"""CalculiX as a process: writes the deck, runs ccx, reads the displacements back. Units mm, N, N/mm²."""
import dataclasses
import os
import pathlib
import shutil
import subprocess
import time

import numpy as np

from scene import UserError
from tet_mesh import CALCULIX_ORDER


@dataclasses.dataclass
class Material:
    shear_modulus: float  # N/mm²
    poisson: float
    neo_hookean: bool = False

    def cards(self, name):
        mu, nu = self.shear_modulus, self.poisson
        if not self.neo_hookean:
            return f"*MATERIAL, NAME={name}\n*ELASTIC\n{2 * mu * (1 + nu):.12g}, {nu:.12g}\n"
        bulk = 2 * mu * (1 + nu) / (3 * (1 - 2 * nu))
        # CalculiX: W = C10 (Ī1 − 3) + (J − 1)²/D1, hence C10 = μ/2 and D1 = 2/κ.
        return f"*MATERIAL, NAME={name}\n*HYPERELASTIC, NEO HOOKE\n{mu / 2:.12g}, {2 / bulk:.12g}\n"


@dataclasses.dataclass
class Cost:
    wall_s: float
    cpu_s: float
    memory_mb: float


@dataclasses.dataclass
class Problem:
    mesh: object
    parts: dict  # name → (rows of tets, Material)
    prescribed: dict  # node → [ux, uy, uz], None where free
    forces: dict = dataclasses.field(default_factory=dict)  # node → [fx, fy, fz] in N
    nonlinear: bool = False
    amplitudes: tuple = (1.0,)  # shares of the prescribed values; more than one only if nonlinear
    first_increment: float = 0.125  # of a nonlinear step
    largest_increment: float = 0.25  # larger ones diverge at the needle and are thrown away
    reaction_nodes: tuple = ()  # nodes whose reaction forces are summed and printed, see read_reactions
    accepts_less: bool = False  # a run that diverges or times out counts as far as it came


def deck_text(problem):
    mesh = problem.mesh
    out = ["*NODE, NSET=ALL"]
    out += [f"{i}, {x:.12g}, {y:.12g}, {z:.12g}" for i, (x, y, z) in enumerate(mesh.nodes, 1)]
    for name, (rows, material) in problem.parts.items():
        out.append(f"*ELEMENT, TYPE=C3D10, ELSET={name}")
        for row in rows:
            ids = mesh.tets[row][CALCULIX_ORDER] + 1
            out.append(f"{row + 1}, " + ", ".join(map(str, ids)))
        out.append(material.cards(name).rstrip())
        out.append(f"*SOLID SECTION, ELSET={name}, MATERIAL={name}")
    if len(problem.reaction_nodes):
        out.append("*NSET, NSET=NEEDLE")
        out += [f"{node + 1}" for node in problem.reaction_nodes]
    if problem.nonlinear:
        # One step for all amplitudes: within a step ccx extrapolates from the increment before; at a step's start it
        # does not, and the elements at the needle are turned inside out by the first guess.
        out.append("*TIME POINTS, NAME=SHARES")
        out += [f"{share:.12g}" for share in problem.amplitudes]
        out.append(
            f"*STEP, NLGEOM, INC=200\n*STATIC\n{problem.first_increment:.12g}, 1., 1e-6, "
            f"{problem.largest_increment:.12g}"
        )
    else:
        out.append("*STEP\n*STATIC")
    out.append("*BOUNDARY")
    for node, values in problem.prescribed.items():
        out += [f"{node + 1}, {k + 1}, {k + 1}, {v:.12g}" for k, v in enumerate(values) if v is not None]
    if problem.forces:
        out.append("*CLOAD")
        for node, values in problem.forces.items():
            out += [f"{node + 1}, {k + 1}, {v:.12g}" for k, v in enumerate(values) if v]
    times = ", TIME POINTS=SHARES" if problem.nonlinear else ""
    if len(problem.reaction_nodes):
        out.append(f"*NODE PRINT, NSET=NEEDLE, TOTALS=ONLY{times}\nRF")
    out.append(f"*NODE PRINT, NSET=ALL{times}\nU\n*END STEP")
    return "\n".join(out) + "\n"


def solve(problem, work, name, timeout_s=1800):
    """Displacements (nodes×3, one array for each amplitude) and what they cost."""
    if shutil.which("ccx") is None:
        raise UserError("ccx is missing; install CalculiX with scripts/setup.sh --reference (Debian: calculix-ccx)")
    work = pathlib.Path(work)
    (work / f"{name}.inp").write_text(deck_text(problem))
    started = time.monotonic()
    # nice and one thread: whoever measures on this machine goes first.
    with open(work / f"{name}.ccx.log", "w") as log:
        process = subprocess.Popen(
            ["nice", "-n", "19", "ccx", "-i", name],
            cwd=work,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() - started > timeout_s:
                process.kill()
                _, status, usage = os.wait4(process.pid, 0)
                if problem.accepts_less:
                    break
                raise UserError(
                    f"ccx took more than {timeout_s} s for {name}; take a coarser level or raise --timeout"
                )
            time.sleep(0.05)
    process.returncode = os.waitstatus_to_exitcode(status)
    cost = Cost(time.monotonic() - started, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)
    text = (work / f"{name}.ccx.log").read_text(errors="replace")
    failed = process.returncode != 0 or "*ERROR" in text
    if failed and not problem.accepts_less:
        raise UserError(f"ccx failed on {name} (code {process.returncode}); see {work / name}.ccx.log")
    fields = read_displacements(work / f"{name}.dat", len(problem.mesh.nodes), cut_short=failed)
    if len(fields) != len(problem.amplitudes) and not (failed and fields):
        raise UserError(
            f"ccx solved {len(fields)} of {len(problem.amplitudes)} steps of {name}; see {work / name}.ccx.log"
        )
    return fields, cost


def read_displacements(file, nodes, cut_short=False):
    """One array (nodes×3) for each time printed; of a run that was cut short, the last may be incomplete and is left
    out then."""
    fields, rows = [], None
    with open(file) as lines:
        for line in lines:
            if line.lstrip().startswith("displacements"):
                rows = np.full((nodes, 3), np.nan)
                fields.append(rows)
            elif line.lstrip().startswith("total force"):
                rows = None
            elif rows is not None and line.strip():
                a = line.split()
                if len(a) == 4:
                    rows[int(a[0]) - 1] = [float(v) for v in a[1:4]]
    if cut_short and fields and np.isnan(fields[-1]).any():
        fields.pop()
    if any(np.isnan(f).any() for f in fields):
        raise UserError(f"{file}: displacements are missing for some nodes")
    return fields


def read_reactions(file):
    """Sum (3, N) of the forces on `reaction_nodes` for each time printed: what the needle exerts on the solved part."""
    sums, awaited = [], False
    with open(file) as lines:
        for line in lines:
            if line.lstrip().startswith("total force"):
                awaited = True
            elif awaited and line.strip():
                sums.append(np.array([float(v) for v in line.split()]))
                awaited = False
    return sums
