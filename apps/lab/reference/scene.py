"""A reference scene: body and needle as a user states them, and the motion that CalculiX imposes.

Two files in a scene's folder. `scene.toml` has the keys of `brachy deform --scene` and nothing else, so the models read
the very file the reference was solved from. `load.toml` says what the needle does and how fine the mesh is; only these
scripts read it. Lengths in mm, moduli in kPa in the files and N/mm² in here; the box is centred on the origin, its axes
are x, y, z; the perineum is the face "-z" and the needle comes along +z.
"""
import dataclasses
import math
import pathlib
import tomllib

import numpy as np

FACES = {"-x": (0, -1), "+x": (0, 1), "-y": (1, -1), "+y": (1, 1), "-z": (2, -1), "+z": (2, 1)}
LEVELS = {"coarse": 1.0, "medium": 0.7, "fine": 0.5}  # factors on a scene's element sizes
LANDMARK_COLUMNS = "x,y,z,dx,dy,dz"


class UserError(Exception):
    """Something the user can repair; the message says how."""


@dataclasses.dataclass
class Load:
    """kind "shaft": a rigid cylinder from `start` to `tip`, with round ends or flat ones, to which the tissue sticks,
    moved by `displacement`. kind "contact": the capsule within one needle radius of `tip` (on the capsule), moved by
    `displacement`. kind "force": dead body forces around the axis from `start` to `tip`. kind "indentation": one dead
    body force around `tip`, along +z, of several magnitudes (forces.py)."""

    kind: str
    tip: np.ndarray  # 3, mm
    displacement: np.ndarray  # 3, mm
    start: np.ndarray  # 3, mm; equal to tip for a contact
    landmark_spacing: float  # mm, between the models' landmarks on the shaft
    has_flat_ends: bool = False  # of a shaft
    blobs: list = dataclasses.field(default_factory=list)  # of Blob, for "force"
    indentations: list = dataclasses.field(default_factory=list)  # (mm, N) for "indentation"


@dataclasses.dataclass
class Blob:
    """A dead force per unit rest volume: `force` times the density of forces.py, around `at`."""

    at: np.ndarray  # 3, mm
    force: np.ndarray  # 3, N
    core: float  # mm


@dataclasses.dataclass
class Nodule:
    """An ellipsoid in the gland with a modulus of its own, bonded to it."""

    centre: np.ndarray  # 3, mm
    semi_axes: np.ndarray  # 3, mm
    shear_modulus: float  # N/mm²

    def measure(self, points):
        """0 in the centre, 1 on the surface (n)."""
        return np.sqrt((((points - self.centre) / self.semi_axes) ** 2).sum(axis=1))


@dataclasses.dataclass
class Scene:
    name: str
    size: np.ndarray  # 3, mm
    held: list  # of faces; the others are free
    shear_modulus: float  # N/mm², of the surround
    poisson: float  # of both
    centre: np.ndarray  # 3, mm, of the gland
    semi_axes: np.ndarray  # 3, mm
    gland_shear_modulus: float
    radius: float  # mm, of the needle
    load: Load
    symmetry: list  # of axes: the field mirrors in these planes through the origin, half of it is solved
    antisymmetry: list  # of axes: it mirrors with its sign turned (motion across the plane; linear scenes only)
    neo_hookean: bool
    amplitudes: list  # shares of the displacement that are solved one after the other
    mesh_needle: float  # mm, element size at the needle, level "coarse"
    mesh_gland: float  # mm, in the gland away from it
    finest: str = "fine"  # the last level to refine to
    mesh_growth: float = 0.25  # of the size, mm for each mm away from the needle (level "coarse")
    increments: tuple = (0.125, 0.25)  # the first and the largest, of a nonlinear step
    held_shafts: list = dataclasses.field(default_factory=list)  # (start, tip) of shafts that stay where they are
    nodules: list = dataclasses.field(default_factory=list)  # of Nodule
    mesh_nodule: float = 0.0  # mm, element size at a nodule's surface

    def in_gland(self, points):
        """Which of the points (n×3) lie in the gland."""
        return (((points - self.centre) / self.semi_axes) ** 2).sum(axis=1) < 1

    def needle_distance(self, points):
        """Distance (n) of the points (n×3) to the surface of the nearest needle, mm; to the contact patch's edge sphere
        for a contact; to the axis less the radius for a force; infinite where there is no needle."""
        if self.load.kind == "indentation":
            return np.full(len(points), np.inf)
        shafts = [(self.load.start, self.load.tip), *self.held_shafts]
        return np.min([self.shaft_distance(points, *shaft) for shaft in shafts], axis=0)

    def shaft_distance(self, points, start, tip):
        """Distance (n) of the points (n×3) to the surface of one needle, mm."""
        length = np.linalg.norm(tip - start)
        if length == 0:
            return np.linalg.norm(points - tip, axis=1) - self.radius
        axis = (tip - start) / length
        if self.load.has_flat_ends:
            along = np.abs((points - (start + tip) / 2) @ axis)
            across = np.linalg.norm(np.cross(points - start, axis), axis=1)
            beyond = np.stack([across - self.radius, along - length / 2])
            return np.linalg.norm(np.maximum(beyond, 0), axis=0) + np.minimum(beyond.max(axis=0), 0)
        # The ends are half-spheres, so the surface is one radius from the segment between their centres.
        tip_inset = self.radius if self.load.kind == "shaft" else 0.0
        along = np.clip((points - start) @ axis, self._start_inset(), length - tip_inset)
        return np.linalg.norm(points - start - along[:, None] * axis, axis=1) - self.radius

    def shaft_leaves_box(self):
        """The shaft runs out through a face, where it has no round end."""
        return self.load.kind == "shaft" and bool(np.any(np.abs(self.load.start) > self.size / 2))

    def _start_inset(self):
        return 0.0 if self.shaft_leaves_box() or self.load.kind == "force" else self.radius

    def landmarks(self):
        """What a model is given (n×6): points of the needle's axis, tip included, with their displacements.
        The spacing is the stated one, stretched so that it divides the shaft inside the box."""
        tip, start = self.load.tip, self.load.start
        if self.load.kind == "contact":
            positions = tip[None, :]
        else:
            axis = (tip - start) / np.linalg.norm(tip - start)
            length = np.linalg.norm(tip - start)
            if self.shaft_leaves_box():  # up to the face it leaves by
                with np.errstate(divide="ignore", invalid="ignore"):
                    exits = np.where(axis != 0, (np.sign(-axis) * self.size / 2 - tip) / -axis, np.inf)
                length = exits.min()
            intervals = max(1, round(length / self.load.landmark_spacing))
            positions = tip - np.linspace(0, length, intervals + 1)[:, None] * axis
        moved = np.hstack([positions, np.tile(self.load.displacement, (len(positions), 1))])
        shift = [np.hstack([held_tip - tip, -self.load.displacement]) for _, held_tip in self.held_shafts]
        return np.vstack([moved] + [moved + s for s in shift])  # held shafts are parallel and as long: _check


def _section(table, name, file):
    if name not in table:
        raise UserError(f"{file}: [{name}] is missing")
    return table[name]


def load_scene(folder):
    """Reads `scene.toml` and `load.toml` of a folder."""
    folder = pathlib.Path(folder)
    tables = []
    for name in ("scene.toml", "load.toml"):
        file = folder / name
        if not file.is_file():
            raise UserError(f"{file}: not there; a scene is a folder with scene.toml and load.toml")
        try:
            tables.append(tomllib.loads(file.read_text()))
        except tomllib.TOMLDecodeError as error:
            raise UserError(f"{file}: {error}") from error
    body, motion = tables
    file = folder / "scene.toml"
    try:
        regions = body["region"]
        if not regions or regions[0]["shape"] != "ellipsoid":
            raise UserError(f'{file}: the first [[region]] is the gland and has shape = "ellipsoid"')
        load = _section(motion, "load", folder / "load.toml")
        tip = np.array(load["tip_mm"], float)
        mesh = motion["mesh"]
        scene = Scene(
            name=folder.name,
            size=np.array(body["box"]["size_mm"], float),
            held=list(body["box"]["held"]),
            shear_modulus=body["tissue"]["shear_modulus_kpa"] * 1e-3,
            poisson=body["tissue"]["poisson"],
            centre=np.array(regions[0]["centre_mm"], float),
            semi_axes=np.array(regions[0]["semi_axes_mm"], float),
            gland_shear_modulus=regions[0]["shear_modulus_kpa"] * 1e-3,
            radius=body["needle"]["radius_mm"],
            load=Load(
                kind=load["kind"],
                tip=tip,
                displacement=np.array(load["displacement_mm"] if is_moved(load["kind"]) else [0, 0, 0], float),
                start=np.array(load.get("start_mm", tip), float),
                landmark_spacing=load.get("landmark_spacing_mm", 3.0),
                has_flat_ends=load.get("flat_ends", False),
                blobs=_insertion_blobs(load, tip) if load["kind"] == "force" else [],
                indentations=_indentations(load) if load["kind"] == "indentation" else [],
            ),
            symmetry=list(motion.get("symmetry", [])),
            antisymmetry=list(motion.get("antisymmetry", [])),
            neo_hookean=motion.get("neo_hookean", False),
            amplitudes=list(motion.get("amplitudes", [1.0])),
            mesh_needle=mesh["needle_mm"],
            mesh_gland=mesh["gland_mm"],
            finest=mesh.get("finest", "fine"),
            mesh_growth=mesh.get("growth", 0.25),
            increments=tuple(motion.get("increments", (0.125, 0.25))),
            held_shafts=[
                (np.array(held["start_mm"], float), np.array(held["tip_mm"], float))
                for held in motion.get("held_shaft", [])
            ],
            nodules=[_nodule(region, file) for region in regions[1:]],
            mesh_nodule=mesh["nodule_mm"] if len(regions) > 1 else 0.0,
        )
    except KeyError as error:
        raise UserError(f"{folder}: the key {error} is missing in scene.toml or load.toml") from error
    _check(scene, folder)
    return scene


def _nodule(region, file):
    if region["shape"] not in ("sphere", "ellipsoid"):
        raise UserError(f'{file}: a nodule, a [[region]] after the gland, has shape = "sphere" or "ellipsoid"')
    axes = [region["radius_mm"]] * 3 if region["shape"] == "sphere" else region["semi_axes_mm"]
    return Nodule(np.array(region["centre_mm"], float), np.array(axes, float), region["shear_modulus_kpa"] * 1e-3)


def is_moved(kind):
    """Whether a needle of this kind is moved by a stated displacement; the other kinds are forces."""
    return kind in ("shaft", "contact")


def _insertion_blobs(load, tip):
    """Friction along the axis, one blob in the middle of each interval, and the force at the tip."""
    start, friction = np.array(load["start_mm"], float), load["friction"]
    length = float(np.linalg.norm(tip - start))
    axis = (tip - start) / length
    intervals = round(length / friction["spacing_mm"])
    step = length / intervals
    blobs = [
        Blob(start + (i + 0.5) * step * axis, friction["newton_per_mm"] * step * axis, friction["core_mm"])
        for i in range(intervals)
    ]
    if "tip_force" in load:
        blobs.append(Blob(tip, load["tip_force"]["newton"] * axis, load["tip_force"]["core_mm"]))
    return blobs


def _indentations(load):
    """Each displacement d of the linear solution (mm) with its force (N)."""
    linear, quadratic = load["newton_per_mm"], load["newton_per_mm2"]
    return [(float(d), linear * d + quadratic * d * d) for d in load["displacements_mm"]]


def _check(scene, folder):
    for face in scene.held:
        if face not in FACES:
            raise UserError(f"{folder}/scene.toml: held has \"{face}\"; faces are {', '.join(FACES)}")
    if scene.load.kind not in ("shaft", "contact", "force", "indentation"):
        raise UserError(
            f'{folder}/load.toml: kind is "shaft", "contact", "force" or "indentation", not "{scene.load.kind}"'
        )
    for start, tip in scene.held_shafts:
        if not np.allclose(tip - start, scene.load.tip - scene.load.start):
            raise UserError(f"{folder}/load.toml: a held shaft must be parallel to the moved one and as long")
    if scene.nodules and scene.load.kind != "shaft":
        raise UserError(f'{folder}/scene.toml: nodules are for loads of kind "shaft"')
    for i, nodule in enumerate(scene.nodules):
        reach = (np.abs(nodule.centre - scene.centre) + nodule.semi_axes) / scene.semi_axes
        if np.linalg.norm(reach) >= 1:
            raise UserError(f"{folder}/scene.toml: a nodule must lie inside the gland, clear of its surface")
        for other in scene.nodules[:i]:
            if np.linalg.norm(nodule.centre - other.centre) <= nodule.semi_axes.max() + other.semi_axes.max():
                raise UserError(f"{folder}/scene.toml: nodules must lie apart")
    if scene.load.kind == "contact" and not math.isclose(
        np.linalg.norm((scene.load.tip - scene.centre) / scene.semi_axes), 1, abs_tol=1e-6
    ):
        raise UserError(f"{folder}/load.toml: the tip of a contact must lie on the capsule")
    if scene.load.has_flat_ends and (scene.load.kind != "shaft" or scene.shaft_leaves_box()):
        raise UserError(f"{folder}/load.toml: flat_ends is for a shaft that ends in the box")
    too_short = np.linalg.norm(scene.load.tip - scene.load.start) < 2 * scene.radius - 1e-9
    if scene.load.kind == "shaft" and too_short and not scene.load.has_flat_ends:
        raise UserError(
            f"{folder}/load.toml: the shaft is shorter than its two round ends; move start_mm away, or set "
            "flat_ends = true"
        )
    if scene.amplitudes[-1] != 1.0 or sorted(set(scene.amplitudes)) != scene.amplitudes:
        raise UserError(f"{folder}/load.toml: amplitudes must rise and end with 1.0")
    if len(scene.amplitudes) > 1 and not scene.neo_hookean:
        raise UserError(f"{folder}/load.toml: a linear scene needs no amplitudes, its answer scales")
    if scene.finest not in LEVELS:
        raise UserError(f"{folder}/load.toml: finest is one of {', '.join(LEVELS)}, not \"{scene.finest}\"")
    for axis in scene.symmetry + scene.antisymmetry:
        k = "xyz".index(axis)
        centres = [scene.load.tip, scene.load.start, scene.centre, *(nodule.centre for nodule in scene.nodules)]
        if any(centre[k] for centre in centres):
            raise UserError(f"{folder}/load.toml: needle, gland and nodules must lie in the plane {axis} = 0")
        across = np.arange(3) == k
        if scene.load.displacement[across if axis in scene.symmetry else ~across].any():
            raise UserError(
                f"{folder}/load.toml: the motion must lie in a plane of symmetry, across one of antisymmetry"
            )
        if ("-" + axis in scene.held) != ("+" + axis in scene.held):
            raise UserError(
                f"{folder}: of the faces -{axis} and +{axis} one is held: {axis} = 0 is no plane of symmetry"
            )
    if scene.antisymmetry and scene.neo_hookean:
        raise UserError(f"{folder}/load.toml: antisymmetry holds for linear scenes only")
