"""Second-order tetrahedra fitted to gland and needle, meshed by gmsh, and the field of a solution between the nodes.

Why tetrahedra: gland, oblique needle and its round tip are met exactly, and the size can follow the field; a structured
hexahedral mesh would either cut the interfaces into steps (first order, whatever the element) or need a topology for
each needle. Why second order: C3D10 does not lock at ν = 0.49, which `check.py` shows against closed forms. gmsh
runs as
a process on a .geo text, as CalculiX does on its deck; neither is linked.
"""
import dataclasses
import pathlib
import shutil
import subprocess

import numpy as np
from scipy.spatial import cKDTree

from scene import UserError

# Edges of a gmsh tet10, as pairs of corners, in gmsh's order; CalculiX wants the last two swapped.
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))
CALCULIX_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


@dataclasses.dataclass
class TetMesh:
    nodes: np.ndarray  # n×3, mm
    tets: np.ndarray  # m×10 into nodes, gmsh's order
    volume_tags: np.ndarray  # m, gmsh's volume of each

    def centroids(self):
        return self.nodes[self.tets[:, :4]].mean(axis=1)


def geo_text(scene, factor):
    """The body without the needle as a .geo: half or quarter of the box by symmetry, gland and surround sharing
    nodes."""
    half = scene.size / 2
    low = [0.0 if axis in scene.symmetry + scene.antisymmetry else -half[k] for k, axis in enumerate("xyz")]
    extent = half - np.array(low)
    c, s, r = scene.centre, scene.semi_axes, scene.radius
    tip, start = scene.load.tip, scene.load.start
    lines = [
        f"// {scene.name}, element sizes × {factor:g}; written by apps/lab/reference, lengths in mm",
        'SetFactory("OpenCASCADE");',
        "General.NumThreads = 1; Mesh.RandomSeed = 1;  // the same mesh every time",
        "Mesh.ElementOrder = 2; Mesh.HighOrderOptimize = 1; Mesh.Optimize = 1;",
        "Mesh.MshFileVersion = 2.2; Mesh.SaveAll = 1;",
        "Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0;",
        "Mesh.CharacteristicLengthFromCurvature = 0;",
        f"Box(1) = {{{_list(low)}, {_list(extent)}}};",
        "Sphere(2) = {0, 0, 0, 1};",
        f"Dilate {{{{0, 0, 0}}, {{{_list(s)}}}}} {{ Volume{{2}}; }}",
        f"Translate {{{_list(c)}}} {{ Volume{{2}}; }}",
    ]
    if scene.load.kind == "shaft":
        lines += _shafts(scene, r)
    elif scene.load.kind in ("force", "indentation"):
        lines += [
            "gland() = BooleanIntersection{ Volume{2}; Delete; }{ Volume{1}; };",
            "all() = BooleanFragments{ Volume{1}; Delete; }{ Volume{gland()}; Delete; };",
        ]
    else:
        # The sphere only draws the rim of the patch on the capsule; all of it stays tissue.
        lines += [
            f"Sphere(3) = {{{_list(tip)}, {r:.12g}}};",
            "tissue() = {1};",
            "gland() = BooleanIntersection{ Volume{2}; Delete; }{ Volume{1}; };",
            "rim() = BooleanIntersection{ Volume{3}; Delete; }{ Volume{1}; };",
            "all() = BooleanFragments{ Volume{1}; Delete; }{ Volume{gland(), rim()}; Delete; };",
        ]
    lines += _sizes(scene, factor)
    return "\n".join(lines) + "\n"


def _list(values):
    return ", ".join(f"{v:.12g}" for v in values)


def _shafts(scene, r):
    """The shafts cut out of the body; the moved one is made of the volumes 3 to 5, a held one of 13 to 15 and so on."""
    lines, volumes = [], []
    for i, (start, tip) in enumerate([(scene.load.start, scene.load.tip), *scene.held_shafts]):
        shaft, parts = _shaft(scene, tip, start, r, 10 * i)
        lines += shaft
        volumes += parts
    needle = f"Volume{{{', '.join(volumes)}}};"
    nodules = []
    for i, nodule in enumerate(scene.nodules):
        nodules.append(f"nodule{i}()")
        lines += [
            f"Sphere({1000 + i}) = {{0, 0, 0, 1}};",
            f"Dilate {{{{0, 0, 0}}, {{{_list(nodule.semi_axes)}}}}} {{ Volume{{{1000 + i}}}; }}",
            f"Translate {{{_list(nodule.centre)}}} {{ Volume{{{1000 + i}}}; }}",
        ]
    clip = [f"nodule{i}() = BooleanIntersection{{ Volume{{{1000 + i}}}; Delete; }}{{ Volume{{tissue()}}; }};"
            for i in range(len(nodules))]
    return lines + [
        f"tissue() = BooleanDifference{{ Volume{{1}}; Delete; }}{{ {needle} Delete; }};",
        "gland() = BooleanIntersection{ Volume{2}; Delete; }{ Volume{tissue()}; };",
        *clip,
        f"all() = BooleanFragments{{ Volume{{tissue()}}; Delete; }}{{ Volume{{{', '.join(['gland()', *nodules])}}}; "
        "Delete; };",
    ]


def _shaft(scene, tip, start, r, offset):
    """The lines that make one shaft, and the numbers of its volumes (3 to 5 plus the offset)."""
    length = float(np.linalg.norm(tip - start))
    axis = (tip - start) / length
    if axis[1] != 0:
        raise UserError(f"{scene.name}: the shaft must lie in a plane y = constant")
    tip_inset = 0.0 if scene.load.has_flat_ends else r
    inset = 0.0 if scene.shaft_leaves_box() else tip_inset
    cylinder, tip_end, start_end = (str(offset + n) for n in (3, 4, 5))
    lines, parts = [], []
    # Built along z with the tip at the origin. Half-spheres share a disc with the cylinder: no tangent surfaces to
    # intersect.
    if tip_inset > 0:
        lines.append(f"Sphere({tip_end}) = {{0, 0, {-r:.12g}, {r:.12g}, 0, Pi/2, 2*Pi}};")
        parts.append(tip_end)
    middle = length - tip_inset - inset
    if middle > 1e-9:
        lines.append(f"Cylinder({cylinder}) = {{0, 0, {-(length - inset):.12g}, 0, 0, {middle:.12g}, {r:.12g}}};")
        parts.append(cylinder)
    if inset > 0:
        lines.append(f"Sphere({start_end}) = {{0, 0, {-(length - inset):.12g}, {r:.12g}, -Pi/2, 0, 2*Pi}};")
        parts.append(start_end)
    needle = f"Volume{{{', '.join(parts)}}};"
    lines += [
        f"Rotate {{{{0, 1, 0}}, {{0, 0, 0}}, {np.arctan2(axis[0], axis[2]):.15g}}} {{ {needle} }}",
        f"Translate {{{_list(tip)}}} {{ {needle} }}",
    ]
    return lines, parts


def _sizes(scene, factor):
    """Element size: growing away from the needle up to the gland's, and growing again outside the gland."""
    r, tip = scene.radius, scene.load.tip
    needle, gland = scene.mesh_needle * factor, scene.mesh_gland * factor
    c, s = scene.centre, scene.semi_axes
    q = _measure(c, s)
    outside = f"{gland:.6g}+{0.25 * s.min() * factor:.6g}*(abs({q}-1)+{q}-1)/2"
    if scene.load.kind == "shaft":
        distances = [_distance(start, tip, r) for start, tip in [(scene.load.start, tip), *scene.held_shafts]]
    elif scene.load.kind in ("force", "indentation"):  # no needle; finest on the axis
        distances = [_distance(scene.load.start, tip, 0.0)]
    else:  # from the rim, where a bonded rigid patch has a square-root singularity
        square = "+".join(f"({x}-({o:.12g}))^2" for x, o in zip("xyz", tip))
        slope = np.linalg.norm(
            (tip - c) / s**2
        )  # |∇q| at the contact: (q − 1)/slope is the distance to the capsule
        distances = [f"sqrt((sqrt({square})-{r:.12g})^2+(({q}-1)/{slope:.12g})^2)"]
    lines = ["Field[1] = MathEval;", f'Field[1].F = "{outside}";']
    for i, distance in enumerate(distances, 2):
        lines += [
            f"Field[{i}] = MathEval;",
            f'Field[{i}].F = "{needle:.6g}+{scene.mesh_growth * factor ** 0.5:.6g}*abs({distance})";',
        ]
    for i, nodule in enumerate(scene.nodules, len(distances) + 2):
        lines += [
            f"Field[{i}] = MathEval;",
            f'Field[{i}].F = "{scene.mesh_nodule * factor:.6g}+{scene.mesh_growth * factor ** 0.5:.6g}'
            f'*{nodule.semi_axes.min():g}*abs({_measure(nodule.centre, nodule.semi_axes)}-1)";',
        ]
    last = len(distances) + len(scene.nodules) + 2
    fields = ", ".join(str(i) for i in range(1, last))
    return lines + [f"Field[{last}] = Min; Field[{last}].FieldsList = {{{fields}}}; Background Field = {last};"]


def _measure(c, s):
    """gmsh's formula that is 0 in an ellipsoid's centre and 1 on its surface."""
    return f"sqrt(((x-({c[0]:g}))/{s[0]:g})^2+((y-({c[1]:g}))/{s[1]:g})^2+((z-({c[2]:g}))/{s[2]:g})^2)"


def _distance(start, tip, r):
    """gmsh's formula for the distance to a round-ended cylinder's surface (about that to a flat-ended one's), to a
    segment or a point with r = 0."""
    length = np.linalg.norm(tip - start)
    axis = (tip - start) / length if length > 0 else np.array([0.0, 0, 1])
    centre = tip - axis * length / 2
    reach = max(length / 2 - r, 0.0)
    along = "+".join(f"({a:.12g})*({x}-({o:.12g}))" for a, x, o in zip(axis, "xyz", centre))
    # along the axis, past the shaft's ends
    beyond = f"((abs(abs({along})-{reach:.12g})+abs({along})-{reach:.12g})/2)"
    square = "+".join(f"({x}-({o:.12g}))^2" for x, o in zip("xyz", centre))
    return f"(sqrt(abs({square}-({along})^2)+{beyond}^2)-{r:.12g})"


def build(text, work, name):
    """Runs gmsh on a .geo text; `work` keeps the .geo, the mesh and the log."""
    if shutil.which("gmsh") is None:
        raise UserError("gmsh is missing; install it with scripts/setup.sh --reference")
    work = pathlib.Path(work)
    geo, msh, log = work / f"{name}.geo", work / f"{name}.msh", work / f"{name}.gmsh.log"
    geo.write_text(text)
    with open(log, "w") as out:
        code = subprocess.call(
            ["nice", "-n", "19", "gmsh", "-3", "-format", "msh2", str(geo), "-o", str(msh)],
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    if code != 0 or not msh.is_file():
        raise UserError(f"gmsh could not mesh {name}; see {log}")
    return read_msh(msh)


def read_msh(file):
    """Nodes and ten-node tetrahedra of a version 2.2 file; nodes that no tetrahedron uses are dropped."""
    lines = pathlib.Path(file).read_text().split("\n")
    at = lines.index("$Nodes")
    count = int(lines[at + 1])
    table = np.array([line.split() for line in lines[at + 2 : at + 2 + count]], float)
    row_of = np.zeros(int(table[:, 0].max()) + 1, int)
    row_of[table[:, 0].astype(int)] = np.arange(count)
    at = lines.index("$Elements")
    count = int(lines[at + 1])
    tets, tags = [], []
    for line in lines[at + 2 : at + 2 + count]:
        fields = line.split()
        if fields[1] == "11":
            skip = 3 + int(fields[2])
            tags.append(int(fields[4]))
            tets.append(fields[skip:])
    if not tets:
        raise UserError(f"{file}: no second-order tetrahedra in it")
    tets = row_of[np.array(tets, int)]
    used, compact = np.unique(tets, return_inverse=True)
    return TetMesh(table[used, 1:4], compact.reshape(tets.shape), np.array(tags))


def shape_functions(b):
    """Ten quadratic shape functions (n×10) at barycentric coordinates b (n×4)."""
    return np.hstack([b * (2 * b - 1)] + [4 * b[:, [i]] * b[:, [j]] for i, j in EDGES])


def shape_derivatives(b):
    """n×10×4: by barycentric coordinate."""
    out = np.zeros((len(b), 10, 4))
    for i in range(4):
        out[:, i, i] = 4 * b[:, i] - 1
    for k, (i, j) in enumerate(EDGES):
        out[:, 4 + k, i] = 4 * b[:, j]
        out[:, 4 + k, j] = 4 * b[:, i]
    return out


class Locator:
    """Finds points in a mesh once; evaluates as many nodal fields there as wanted."""

    def __init__(self, mesh, points):
        tree = cKDTree(mesh.centroids())
        found, inside, b = _find(mesh, tree, points, 24)
        lost = np.flatnonzero(~inside)
        if len(lost):  # a large element among many small ones: its centroid is not among the nearest
            found[lost], inside[lost], b[lost] = _find(mesh, tree, points[lost], 1000)
        if not inside.all():
            raise UserError(
                f"{(~inside).sum()} points lie in no element, the first at {points[~inside][0]}; "
                "are they in the needle?"
            )
        self.tets, self.shape = mesh.tets[found], shape_functions(b)

    def evaluate(self, nodal):
        """n×3 from a nodal field (nodes×3)."""
        return np.einsum("pa,pai->pi", self.shape, nodal[self.tets])


def _find(mesh, tree, points, candidates):
    """For each point the element (n) that holds it best, whether it does (n), and the barycentric coordinates (n×4)."""
    k = min(candidates, len(mesh.tets))
    near = tree.query(points, k)[1].reshape(len(points), k)
    X = mesh.nodes[mesh.tets[near.ravel()]]  # (n·k)×10×3
    target = np.repeat(points, k, axis=0)
    b = np.full((len(target), 4), 0.25)
    for _ in range(8):  # Newton on the curved map; straight elements are done after the first
        residual = target - np.einsum("ea,eai->ei", shape_functions(b), X)
        D = np.einsum("eab,eai->eib", shape_derivatives(b), X)
        J = D[:, :, 1:] - D[:, :, :1]
        J[np.abs(np.linalg.det(J)) < 1e-12] = np.eye(3)  # a far candidate's map may be singular out there
        step = np.linalg.solve(J, residual[:, :, None])[:, :, 0]
        b[:, 1:] = np.clip(b[:, 1:] + np.clip(step, -4, 4), -20, 20)
        b[:, 0] = 1 - b[:, 1:].sum(axis=1)
    worst = b.min(axis=1)
    miss = np.linalg.norm(target - np.einsum("ea,eai->ei", shape_functions(b), X), axis=1)
    worst[miss > 1e-6] = -np.inf
    pick = np.arange(len(points)) * k + worst.reshape(len(points), k).argmax(axis=1)
    return near.ravel()[pick], worst[pick] > -1e-3, b[pick]
