"""What a needle that is pushed through a hole and only turned can reach: measured by some insertions."""
from __future__ import annotations

from dataclasses import dataclass
from typing import List, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .simulator import Simulator

Array = npt.NDArray[np.float64]
INSERTED = 2  # ContactState
MM_PER_TICK = 0.5  # of the insertions that measure
ROLLS = 3


@dataclass
class Reach:
    """Of each hole, where the tip goes in the tissue at rest. Frame W, mm.

    A bevel that does not turn leads the tip aside at an angle that depends on where it points; one that turns all the
    time cancels itself out. So at a depth z the tip can be anywhere in a disc: around where insertions with the bevel
    to all sides come out on average, as wide as the narrowest of them.
    """
    hole_mm: Array  # h×2, x and y
    start_mm: Array  # h, the hand's z, 2 mm before the needle meets the tissue
    z_mm: Array  # k, ascending: depths at rest
    middle_mm: Array  # h×k×2, the disc's middle; NaN where the tip does not come
    radius_mm: Array  # h×k
    bevel_rad: float  # where the bevel leads the tip at roll 0: angle from +x towards +y

    def depths(self, hole: int) -> Array:
        """The depths at which the hole has a disc."""
        at: Array = self.z_mm[np.isfinite(self.radius_mm[hole])]
        return at

    def disc(self, hole: int, z_mm: Union[float, Array]) -> Tuple[Array, Array]:
        """Middle …×2 and radius … at depths z; those of the nearest depth beyond the ends."""
        is_in = np.isfinite(self.radius_mm[hole])
        z, middle = self.z_mm[is_in], self.middle_mm[hole][is_in]
        at = np.stack([np.interp(z_mm, z, middle[:, k]) for k in range(2)], axis=-1)
        return at, np.asarray(np.interp(z_mm, z, self.radius_mm[hole][is_in]))


def pose_at(hole_mm: Sequence[float], hand_mm: float, roll_rad: float) -> Array:
    """X_WN, 3×4, of needle along +z."""
    c, s = float(np.cos(roll_rad)), float(np.sin(roll_rad))
    return np.array([[c, -s, 0, hole_mm[0]], [s, c, 0, hole_mm[1]], [0, 0, 1, hand_mm]])


def measure(simulator: Simulator, holes_mm: Sequence[Sequence[float]], margin_mm: float) -> Reach:
    """Pushes needle 0 through each hole with the bevel to some sides, until `margin_mm` before the tissue's end or to
    where it first touches an organ. The simulator is reset. Errors: ValueError for a hole whose needle does not come
    into the tissue, or into an organ first."""
    low, high = (float(f(simulator.rest_positions[:, 2])) for f in (np.min, np.max))
    z = np.arange(np.ceil(2 * low) / 2, high - margin_mm, 0.5)
    starts, middles, radii, bevels = [], [], [], []
    for hole in holes_mm:
        paths, start = [], high
        for roll in np.arange(ROLLS) * 2 * np.pi / ROLLS:
            first, path = _insertion(simulator, hole, float(roll), low - 5, high - margin_mm)
            start = min(start, first)
            paths.append([np.interp(z, path[:, 2], path[:, k], left=np.nan, right=np.nan) for k in range(2)])
        tips: Array = np.array(paths).transpose(0, 2, 1)  # rolls×k×2
        middle = tips.mean(axis=0)
        off = tips - middle
        radius = np.linalg.norm(off, axis=2).min(axis=0)
        if not np.isfinite(radius).any():
            raise ValueError(f"hole ({hole[0]}, {hole[1]}) mm: its needle does not come into the tissue, or into an "
                             "organ first; choose another")
        starts.append(start - 2)
        middles.append(middle)
        radii.append(radius)
        bevels.append(off[0, np.isfinite(radius)][-1])
    simulator.reset()
    side = np.sum(bevels, axis=0)
    return Reach(np.array(holes_mm, dtype=np.float64), np.array(starts), z, np.array(middles), np.array(radii),
                 float(np.arctan2(side[1], side[0])))


def _insertion(simulator: Simulator, hole: Sequence[float], roll_rad: float, start: float,
               end: float) -> Tuple[float, Array]:
    """The hand's z as it meets the tissue, and the tip's way at rest while it is in the tissue and in no organ."""
    fields = simulator.observation_fields
    pose = pose_at(hole, start, roll_rad)
    simulator.reset()
    first, path = end, []  # type: Tuple[float, List[Array]]
    row = simulator.observe()
    for hand in np.arange(start, end + 20, MM_PER_TICK):
        pose[2, 3] = hand
        simulator.step(pose)
        simulator.observe(out=row)
        if row[fields["contact"]] != 0:
            first = min(first, float(hand))
        if row[fields["organ_passes"]] > 0 or (path and path[-1][2] >= end):
            break
        if row[fields["contact"]] == INSERTED:
            path.append(row[fields["tip_rest_mm"]].copy())
        elif path:
            break
    way = np.array(path) if path else np.full((1, 3), np.nan)
    return first, way[np.r_[True, np.diff(np.maximum.accumulate(way[:, 2])) > 0]]
