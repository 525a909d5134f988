"""Dead body forces, each spread over the density

    blob(r; c) = 15 c⁴ / (8 pi (r² + c²)^(7/2)),

whose integral over space is 1 and whose linear response in an infinite solid is the regularised Kelvin solution of
kelvin.py with s + s' = c², for every ν. A dead force acts per unit of rest volume and keeps its direction.
"""
import numpy as np
from scipy.optimize import brentq
from scipy.special import roots_jacobi

from tet_mesh import shape_derivatives, shape_functions

GAUSS = 4  # points in each direction: exact to degree 7


def blob_density(points, at, core):
    """Of a unit force (n), 1/mm³."""
    square = ((points - at) ** 2).sum(axis=-1)
    return 15 * core**4 / (8 * np.pi * (square + core**2) ** 3.5)


def _tet_rule():
    """Barycentric points (n×4) and weights (n) of a rule on the unit tetrahedron, whose volume is 1/6."""
    (a, wa), (b, wb), (c, wc) = (roots_jacobi(GAUSS, k, 0) for k in (2, 1, 0))  # weight (1 - t)^k on [-1, 1]
    A, B, C = np.meshgrid((1 + a) / 2, (1 + b) / 2, (1 + c) / 2, indexing="ij")
    weights = np.einsum("i,j,k->ijk", wa / 8, wb / 4, wc / 2).ravel()
    x, y, z = A.ravel(), (B * (1 - A)).ravel(), (C * (1 - A) * (1 - B)).ravel()
    return np.stack([1 - x - y - z, x, y, z], axis=1), weights


class Quadrature:
    """Integrates body forces over a mesh at rest against its shape functions."""

    def __init__(self, mesh):
        self.mesh, self.points = mesh, None  # prepared when first used: most scenes have no forces

    def nodal_forces(self, blobs):
        """node → [fx, fy, fz] in N of the blobs' sum; {} without any."""
        if not blobs:
            return {}
        nodal = sum(self.nodal_density(blob.at, blob.core)[:, None] * blob.force for blob in blobs)
        return {int(node): [float(v) for v in nodal[node]] for node in np.flatnonzero(np.abs(nodal).any(axis=1))}

    def nodal_density(self, at, core):
        """Consistent nodal forces (nodes) of a unit blob."""
        if self.points is None:
            self._prepare()
        local = np.einsum("eq,qa->ea", self.volumes * blob_density(self.points, at, core), self.shape)
        return np.bincount(self.mesh.tets.ravel(), local.ravel(), len(self.mesh.nodes))

    def _prepare(self):
        """Points (tets×n×3) and the volume that each stands for (tets×n)."""
        b, weights = _tet_rule()
        X = self.mesh.nodes[self.mesh.tets]
        D = np.einsum("qab,eai->eqib", shape_derivatives(b), X)
        self.shape = shape_functions(b)
        self.points = np.einsum("qa,eai->eqi", self.shape, X)
        self.volumes = weights * np.abs(np.linalg.det(D[..., 1:] - D[..., :1]))


def core_for(quadrature, green, at, force, displacement):
    """The core with which a force (N, along z) at `at` displaces that point by `displacement` (mm) in the linear
    solution. `green` (nodes): z displacements of a unit point force there, so by reciprocity the blob's response at the
    point is its nodal forces times green."""
    return brentq(lambda c: force * (quadrature.nodal_density(at, c) @ green) - displacement, 0.5, 60, xtol=1e-6)
