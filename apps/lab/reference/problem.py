"""From a scene and a mesh to the boundary-value problem: which nodes are held, mirrored or moved by the needle."""
import numpy as np

import forces
from calculix import Material, Problem
from scene import FACES, UserError, is_moved

ON_SURFACE = 1e-4  # mm: gmsh puts nodes on the geometry to about 1e-7


def gland_rows(mesh, scene):
    """Which tets are gland, nodules included."""
    return _rows_inside(mesh, scene.in_gland(mesh.centroids()), f"{scene.name}: the mesh does not follow the capsule")


def nodule_rows(mesh, scene, nodule):
    """Which tets are a nodule."""
    inside = nodule.measure(mesh.centroids()) < 1
    return _rows_inside(mesh, inside, f"{scene.name}: the mesh does not follow a nodule")


def _rows_inside(mesh, inside, otherwise):
    """Decided for each of gmsh's volumes as a whole, never tet by tet."""
    rows = np.zeros(len(mesh.tets), bool)
    for tag in np.unique(mesh.volume_tags):
        here = mesh.volume_tags == tag
        share = inside[here].mean()
        if 0.05 < share < 0.95:
            raise UserError(f"{otherwise} (volume {tag}: {share:.0%} inside)")
        rows[here] = share > 0.5
    return rows


def needle_nodes(mesh, scene):
    """Nodes that move with the needle: on the shaft's surface, or on the capsule within a radius of the contact."""
    if scene.load.kind == "shaft":
        return shaft_nodes(mesh, scene, scene.load.start, scene.load.tip)
    distance = scene.needle_distance(mesh.nodes)
    q = np.sqrt((((mesh.nodes - scene.centre) / scene.semi_axes) ** 2).sum(axis=1))
    on_capsule = np.abs(q - 1) * scene.semi_axes.min() < ON_SURFACE
    return np.flatnonzero(on_capsule & (distance < ON_SURFACE))


def shaft_nodes(mesh, scene, start, tip):
    """Nodes on the surface of one shaft."""
    distance = scene.shaft_distance(mesh.nodes, start, tip)
    if distance.min() < -0.02 * scene.radius:
        raise UserError(f"{scene.name}: tissue inside the needle; the mesh does not follow it")
    return np.flatnonzero(distance < ON_SURFACE)


def conditions(mesh, scene):
    """node → [ux, uy, uz], None where free. The needle overrules a held face, which overrules symmetry."""
    prescribed = {}
    for axis in scene.symmetry + scene.antisymmetry:
        k = "xyz".index(axis)
        zero = [k] if axis in scene.symmetry else [j for j in range(3) if j != k]
        for node in np.flatnonzero(np.abs(mesh.nodes[:, k]) < 1e-7):
            for j in zero:
                prescribed.setdefault(int(node), [None] * 3)[j] = 0.0
    for face in scene.held:
        k, side = FACES[face]
        for node in np.flatnonzero(np.abs(mesh.nodes[:, k] - side * scene.size[k] / 2) < 1e-7):
            prescribed[int(node)] = [0.0] * 3
    if not is_moved(scene.load.kind):
        return prescribed
    needles = [(needle_nodes(mesh, scene), scene.load.displacement)]
    needles += [(shaft_nodes(mesh, scene, *shaft), np.zeros(3)) for shaft in scene.held_shafts]
    for nodes, displacement in needles:
        if len(nodes) < 10:
            raise UserError(f"{scene.name}: only {len(nodes)} nodes on the needle; the mesh does not follow it")
        for node in nodes:
            prescribed[int(node)] = [float(v) for v in displacement]
    return prescribed


def pose(mesh, scene):
    gland = gland_rows(mesh, scene)
    soft = Material(scene.shear_modulus, scene.poisson, scene.neo_hookean)
    stiff = Material(scene.gland_shear_modulus, scene.poisson, scene.neo_hookean)
    first, largest = scene.increments
    surround, nodules = ~gland, {}
    for i, nodule in enumerate(scene.nodules, 1):
        rows = nodule_rows(mesh, scene, nodule)
        gland &= ~rows
        material = Material(nodule.shear_modulus, scene.poisson, scene.neo_hookean)
        nodules[f"NODULE{i}"] = (np.flatnonzero(rows), material)
    parts = {"GLAND": (np.flatnonzero(gland), stiff), "SURROUND": (np.flatnonzero(surround), soft), **nodules}
    return Problem(mesh, parts,
                   conditions(mesh, scene), forces.Quadrature(mesh).nodal_forces(scene.load.blobs),
                   nonlinear=scene.neo_hookean, amplitudes=tuple(scene.amplitudes),
                   first_increment=first, largest_increment=largest)


def linearised(posed):
    """The same problem with linear elasticity and small displacements; full load only."""
    parts = {name: (rows, Material(m.shear_modulus, m.poisson)) for name, (rows, m) in posed.parts.items()}
    return Problem(posed.mesh, parts, posed.prescribed, posed.forces)


def fold(points, scene):
    """Points (n×3) mirrored into the solved part, and the signs (n×3) that bring displacements back."""
    folded, signs = points.copy(), np.ones_like(points)
    for axis in scene.symmetry + scene.antisymmetry:
        k = "xyz".index(axis)
        signs[points[:, k] < 0, k] *= -1
        if axis in scene.antisymmetry:
            signs[points[:, k] < 0] *= -1
        folded[:, k] = np.abs(points[:, k])
    return folded, signs
