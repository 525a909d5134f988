"""One level of one scene solved: the mesh, the run, and the displacements at the points that are looked at."""
import hashlib

import numpy as np

import calculix
import problem
import tet_mesh
from scene import LEVELS


class Solution:
    """One level of one scene: displacements at the points for each amplitude, and the level's figures."""

    def __init__(self, scene, level, points, work, timeout_s):
        factor, name = LEVELS[level], f"{scene.name}-{level}"
        self.level, self.geo = level, tet_mesh.geo_text(scene, factor)
        mesh = tet_mesh.build(self.geo, work, name)
        self.posed, self.work, self.name = problem.pose(mesh, scene), work, name
        self.decks = [name]
        fields = self.solve(scene, timeout_s)
        folded, self.signs = problem.fold(points, scene)
        self.locator = tet_mesh.Locator(mesh, folded)
        self.displacements = [self.at_points(u) for u in fields]
        self.row = {
            "level": level,
            "needle_mm": scene.mesh_needle * factor,
            "gland_mm": scene.mesh_gland * factor,
            "nodes": len(mesh.nodes),
            "tets": len(mesh.tets),
            "cpu_s": self.cost.cpu_s,
            "memory_mb": self.cost.memory_mb,
            "deck_sha256": hashlib.sha256(
                b"".join((work / f"{deck}.inp").read_bytes() for deck in self.decks)
            ).hexdigest(),
        }
        print(
            f"{scene.name:24} {level:7} {len(mesh.nodes):7} nodes  {self.cost.cpu_s:6.1f} s cpu "
            f"{self.cost.wall_s:6.1f} s wall {self.cost.memory_mb:6.0f} MB",
            flush=True,
        )

    def solve(self, scene, timeout_s):
        """Nodal fields (nodes×3), one for each amplitude; sets `cost`."""
        fields, self.cost = calculix.solve(self.posed, self.work, self.name, timeout_s)
        return fields

    def linear(self, timeout_s):
        """Displacements at the points of the linear solution on the same mesh, under the full load."""
        (u,), _ = calculix.solve(problem.linearised(self.posed), self.work, self.name + "-linear", timeout_s)
        return self.at_points(u)

    def at_points(self, nodal):
        return self.locator.evaluate(nodal) * self.signs


def difference(u, reference):
    """Relative L2 of u against the reference (n×3)."""
    return float(np.linalg.norm(u - reference) / np.linalg.norm(reference))
