"""The engine in this process: no daemon, no clock; as many ticks as the processor makes.

It needs the module `brachyd_engine`, which CMake builds where pybind11 is installed (apps/python/README.md).
"""
from __future__ import annotations

import importlib
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Dict, Iterable, List, Optional, Tuple, Union, cast

import numpy as np
import numpy.typing as npt

from .constants import SeedFlag
from .wire import Array, Certificate, FloatArray, Forces, Needle, Seed, StructureDose

if TYPE_CHECKING:
    from .brachyd_engine import Engine

Flags = npt.NDArray[np.bool_]


def _engine_module() -> Any:
    for name in (f"{__package__}.brachyd_engine", "brachyd_engine"):  # installed with the package, or on the path
        try:
            return importlib.import_module(name)
        except ModuleNotFoundError:
            continue
    raise ImportError(
        "brachyd.Simulator needs the module brachyd_engine: build it (scripts/setup.sh --python; "
        "scripts/build.sh release brachyd_engine) and set PYTHONPATH=build/release/python, or install with "
        "BRACHYD_ENGINE=build/release/python pip install ./apps/python")


def slices_of(fields: Iterable[Tuple[str, int]], start: int = 0) -> Dict[str, slice]:
    """Where each field is in a row that has them one after the other, from `start` on."""
    found = {}
    for name, size in fields:
        found[name] = slice(start, start + size)
        start += size
    return found


@dataclass
class Drops:
    """Of one needle since the start. Seeds lost outside the body count as refused."""
    dropped: int
    refused: int
    last_refusal: str


@dataclass
class Ticks:
    """Each tick of Simulator.run(), t of them; n instruments. NaN: it was not there. Frame W, mm, N."""
    force_n: Array  # t×n×3, of the tissue on the needle
    tip_mm: Array  # t×n×3, of a needle that bends where its tip is
    axial_n: Array  # t×n, > 0 pushes it out
    lateral_n: Array  # t×n, ≥ 0
    tip_depth_mm: Array  # t×n
    contact: npt.NDArray[np.uint8]  # t×n: 0 free, 1 touching, 2 inserted, 3 through, 4 withdrawn
    verdict: npt.NDArray[np.uint8]  # t: 0 unknown, 1 injective, 2 folded
    det_bound: Array  # t, of the certificate
    max_displacement_mm: Array  # t


class Simulator:
    """A scene, and its state after the last tick.

    Scenes: a file, `text` as such a file has it, or neither: the default scene. The same poses give the same states
    bit for bit, and those of the daemon. Errors: ValueError with file, line and fix where the scene cannot be used, or
    a pose is not rigid to 1e-3, not finite or beyond 10 m; no tick is made then.
    Threads: one at a time, else RuntimeError. Python's lock is free while ticks are made, so that several simulators
    run on several threads. `positions` may be read meanwhile, and may then be of two ticks.
    `like`: a simulator whose scene it is; both share its model, so that a second one takes neither its time nor its
    memory. They may run on different threads.
    """

    def __init__(self, scene: Optional[Union[str, "PathLike[str]"]] = None, *, text: Optional[str] = None,
                 with_hash: bool = False, threads: Optional[int] = None, simd: str = "",
                 like: Optional["Simulator"] = None) -> None:
        module = _engine_module()
        if like is None:
            self._engine: Engine = module.Engine(file=scene, text=text, with_hash=with_hash, threads=threads, simd=simd)
        elif scene is None and text is None and threads is None and not simd:
            self._engine = module.Engine(like=like._engine, with_hash=with_hash)
        else:
            raise ValueError("like: the scene, its threads and simd are those of the other simulator")
        self._fields: Dict[str, slice] = slices_of(module.OBSERVATION_FIELDS)

    def reset(self) -> None:
        """The tissue at rest, tick 0, no seeds. Takes a millisecond; arrays that were given out show it."""
        self._engine.reset()

    def step(self, poses: Optional[npt.ArrayLike] = None, buttons: Optional[npt.ArrayLike] = None) -> None:
        """One tick. `poses`: 3×4 or 4×4 of needle 0, or n of them, X_WN, mm; NaN throughout: it is not there.
        `buttons`: one, or n; while a needle's is true it drops seeds as the scene's applicator does."""
        self._engine.step(*self._batch(poses, buttons, ticks=False))

    def run(self, poses: npt.ArrayLike, buttons: Optional[npt.ArrayLike] = None) -> Ticks:
        """A tick for each pose in one call: t×3×4 or t×4×4 of needle 0, or t×n×…; `buttons` t or t×n."""
        return Ticks(**cast("dict[str, Any]", self._engine.run(*self._batch(poses, buttons, ticks=True))))

    def drop(self, poses: npt.ArrayLike, needle: int = 0) -> List[Seed]:
        """Presses that needle's button for a tick and releases it in the next, with the needles at `poses`; the seeds
        that fell in these. With applicator "train" a press alone drops nothing: see step()."""
        array = np.asarray(poses, dtype=np.float64)
        pressed = np.zeros(array.shape[0] if array.ndim == 3 else 1, dtype=np.bool_)
        pressed[needle] = True
        before = len(self._engine.seeds())
        self.step(poses, pressed)
        self.step(poses)
        return self.seeds[before:]

    @property
    def needles(self) -> List[Needle]:
        """Of all instruments, by id."""
        found = []
        for n in range(self._engine.needle_count):
            contact, present, landmarks, punctures, depth, X_WN, forces, sequence, tip_depth, shape = \
                self._engine.needle(n)
            needle = Needle(n, contact, present, landmarks, punctures, depth, X_WN)
            needle.forces, needle.input_sequence, needle.tip_depth_mm = Forces(*forces), sequence, tip_depth
            needle.shape = shape
            found.append(needle)
        return found

    @property
    def observation_fields(self) -> Dict[str, slice]:
        """What observe() gives, and where: tip_mm, force_n … as apps/python/engine/observation.h has them."""
        return self._fields

    def observe(self, needle: int = 0, out: Optional[Array] = None) -> Array:
        """The last tick of one needle in a row of numbers, all finite, as observation_fields says; into `out`, a
        row of float64 without gaps, if that is given."""
        if out is None:
            out = np.empty(max(where.stop for where in self._fields.values()))
        self._engine.observe(needle, out)
        return out

    def depths_of(self, points: npt.ArrayLike) -> Dict[str, Array]:
        """By how much each of n×3 points, at rest, lies inside the tissue ("tissue") and inside each organ that needles
        are tested against, by name, mm; < 0 outside."""
        return self._engine.depths_of(np.asarray(points, dtype=np.float64))

    def drops(self, needle: int = 0) -> Drops:
        return Drops(*self._engine.drops(needle))

    @property
    def seeds(self) -> List[Seed]:
        """In the order in which they fell; copies."""
        found = []
        for fields in self._engine.seeds():
            values: List[Any] = list(fields)
            values[4] = SeedFlag.CERTIFIED if fields[4] else SeedFlag(0)
            found.append(Seed(*values))
        return found

    @property
    def certificate(self) -> Certificate:
        """Whether the last tick's field is injective over the continuum."""
        return Certificate(*self._engine.certificate())

    @property
    def plan(self) -> List[Tuple[int, Array]]:
        """Of each planned seed its needle in the plan and its centre at rest, mm; empty without a plan."""
        return self._engine.plan()

    def dose(self) -> List[StructureDose]:
        """Of the seeds that fell, after relaxation: figures and DVH of each structure. About 0.1 s the first time."""
        return [StructureDose(*fields) for fields in self._engine.dose()]

    def dose_at(self, points: npt.ArrayLike) -> Array:
        """Gy at points n×3, mm; NaN outside the grid around the prostate."""
        return self._engine.dose_at(np.asarray(points, dtype=np.float64))

    @property
    def positions(self) -> FloatArray:
        """The mesh as it is, n×3, mm: no copy. It cannot be written, and each tick changes it. Surface vertices come
        first."""
        return self._engine.positions

    @property
    def rest_positions(self) -> FloatArray:
        """The mesh at rest, n×3, mm: no copy, not to be written."""
        return self._engine.rest_positions

    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """Of the surface, m×3, outward: no copy, not to be written."""
        return self._engine.triangles

    @property
    def surface_vertex_count(self) -> int:
        return self._engine.surface_vertex_count

    @property
    def needle_count(self) -> int:
        """Needles, and the probe where the scene has one."""
        return self._engine.needle_count

    @property
    def tick(self) -> int:
        return self._engine.tick

    @property
    def sim_time_s(self) -> float:
        return self._engine.sim_time_s

    @property
    def period_s(self) -> float:
        """Simulated time of a tick."""
        return self._engine.period_s

    @property
    def step_flags(self) -> int:
        """StepFlag bits of core/models/step_flag.h, as in FRAME."""
        return self._engine.step_flags

    @property
    def max_displacement_mm(self) -> float:
        return self._engine.max_displacement_mm

    @property
    def state_hash(self) -> str:
        """Over all ticks, as `brachy replay --offline` prints it for the same poses. Needs with_hash=True."""
        value = self._engine.state_hash
        if value is None:
            raise RuntimeError("Simulator(…, with_hash=True) computes the hash")
        return f"{value:016x}"

    @staticmethod
    def _batch(poses: Optional[npt.ArrayLike], buttons: Optional[npt.ArrayLike],
               ticks: bool) -> Tuple[Array, Optional[Flags]]:
        """t×n×(3|4)×4 and t×n of what a caller gives."""
        if poses is None:
            return np.full((1, 1, 3, 4), np.nan), None
        array = np.asarray(poses, dtype=np.float64)
        rank = array.ndim - ticks
        if rank not in (2, 3):
            raise ValueError(f"poses of shape {array.shape}: 3×4 or 4×4 for one needle, n of them for several")
        if rank == 2:
            array = array[:, None] if ticks else array[None]
        if not ticks:
            array = array[None]
        if buttons is None:
            return array, None
        pressed = np.asarray(buttons, dtype=np.bool_)
        if pressed.size != array.shape[0] * array.shape[1]:
            raise ValueError(f"{pressed.size} buttons for {array.shape[0] * array.shape[1]} poses")
        return array, pressed.reshape(array.shape[:2])

