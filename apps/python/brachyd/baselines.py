"""Three ways to steer, to compare others with: pushing, flipping the bevel by a rule, and model predictive control.

Each takes observations n×m of NeedleSteering and gives actions n×2; one that keeps something from tick to tick begins
again with an environment whose hand is where it started.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Protocol, Tuple

import numpy as np
import numpy.typing as npt

from .reach import INSERTED
from .vector import VectorNeedleSteering

Array = npt.NDArray[np.float64]


class Policy(Protocol):
    def __call__(self, observations: Array) -> Array: ...


def wrapped(angle: Any) -> Any:
    """To −π … π."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


class StraightInsertion:
    """Pushes at full speed, its bevel where it is."""

    def __init__(self, environment: VectorNeedleSteering) -> None:
        del environment

    def __call__(self, observations: Array) -> Array:
        return np.tile([1.0, 0.0], (len(observations), 1))


class BevelFlip:
    """Turns the bevel towards the target when it points away from it by more than 90°, until it is within 10°; slowly
    meanwhile. Nearer than 0.1 mm beside the target it leaves it."""

    def __init__(self, environment: VectorNeedleSteering) -> None:
        self._at, self._turn_rad = environment.observation_fields, environment.turn_rad
        self._is_turning = np.ones(environment.num_envs, dtype=np.bool_)

    def __call__(self, observations: Array) -> Array:
        to, bevel = observations[:, self._at["to_target_mm"]], observations[:, self._at["bevel"]]
        off = wrapped(np.arctan2(to[:, 1], to[:, 0]) - np.arctan2(bevel[:, 1], bevel[:, 0]))
        is_near = np.hypot(to[:, 0], to[:, 1]) < 0.1
        is_new = observations[:, self._at["hand_mm"]][:, 0] == 0
        self._is_turning |= (np.abs(off) > np.pi / 2) | is_new
        self._is_turning &= (np.abs(off) > np.deg2rad(10)) & ~is_near
        turn = np.where(self._is_turning, np.clip(off / self._turn_rad, -1, 1), 0)
        return np.stack([np.where(self._is_turning, 0.25, 1), turn], axis=1)


class ModelPredictive:
    """Every `replan_ticks` it chooses, of turns to one angle and then to another, those whose predicted tip is nearest
    to the target.

    The model is kinematic, a unicycle whose heading leans by a fixed angle to where the bevel points: pushed by dz, the
    tip goes aside by d(middle) + d(radius) · bevel, middle and radius as Reach has measured them, and the bevel turns
    at most at the environment's speed.
    """

    SPEED = 0.5  # share of the hand's
    SEGMENTS = 16  # of the way that remains
    ANGLES = 16
    SWITCHES = (0.2, 0.4, 0.6, 0.8)  # share of the way at which the second turn begins

    def __init__(self, environment: VectorNeedleSteering, replan_ticks: int = 20) -> None:
        self._at, self._reach, self._turn_rad = environment.observation_fields, environment.reach, environment.turn_rad
        self._replan_ticks = replan_ticks
        self._mm_per_tick = self.SPEED * environment.advance_mm
        angles = np.arange(self.ANGLES) * 2 * np.pi / self.ANGLES
        grid = np.meshgrid(angles, self.SWITCHES, angles, indexing="ij")
        self._candidates = np.stack([part.ravel() for part in grid], axis=1)  # first angle, switch, second angle
        self._plans: List[Optional[_Plan]] = [None] * environment.num_envs

    def __call__(self, observations: Array) -> Array:
        return np.array([self._act(i, row) for i, row in enumerate(observations)])

    def _act(self, i: int, row: Array) -> Tuple[float, float]:
        plan, hand = self._plans[i], float(row[self._at["hand_mm"]][0])
        bevel = float(np.arctan2(*row[self._at["bevel"]][::-1]))
        if plan is None or hand == 0 or plan.age >= self._replan_ticks:
            plan = self._plans[i] = self._plan(row, bevel, None if hand == 0 else plan)
        plan.age += 1
        wanted = plan.first if plan.age <= plan.switch_ticks else plan.second
        return self.SPEED, float(np.clip(wrapped(wanted - bevel) / self._turn_rad, -1, 1))

    def _plan(self, row: Array, bevel: float, last: Optional["_Plan"]) -> "_Plan":
        target = row[self._at["target_mm"]]
        hole = int(np.argmin(np.linalg.norm(self._reach.hole_mm - row[self._at["hole_mm"]], axis=1)))
        is_in = row[self._at["contact"]][0] == INSERTED
        tip = row[self._at["tip_rest_mm"]]
        begin = float(tip[2] if is_in else self._reach.depths(hole)[0])
        z = np.linspace(begin, max(float(target[2]), begin + 1e-3), self.SEGMENTS + 1)
        middle, radius = self._reach.disc(hole, z)
        start, wide = (tip[:2], np.diff(radius)) if is_in else (middle[0], np.diff(np.r_[0, radius[1:]]))
        ticks = (z[1:] + z[:-1] - 2 * begin) / 2 / self._mm_per_tick
        ways = self._candidates
        if last is not None:  # what is left of the last plan, so that a good one is kept
            left = max(last.switch_ticks - last.age, 0) / max((z[-1] - begin) / self._mm_per_tick, 1)
            ways = np.vstack([ways, [last.first if left > 0 else last.second, min(left, 1.0), last.second]])
        first, switch, second = (ways[:, k, None] for k in range(3))
        total = (z[-1] - begin) / self._mm_per_tick
        at = np.where(ticks < switch * total, ticks, switch * total)  # spent on the first turn
        # In front of the tissue there is time to turn before anything is cut.
        most = at * self._turn_rad if is_in else np.full_like(at, np.pi)
        angle = bevel + np.clip(wrapped(first - bevel), -most, most)
        more = np.maximum(ticks - switch * total, 0) * self._turn_rad
        angle = angle + np.clip(wrapped(second - angle), -more, more)
        aside = np.stack([(wide * np.cos(angle)).sum(axis=1), (wide * np.sin(angle)).sum(axis=1)], axis=1)
        off = np.linalg.norm(start + middle[-1] - middle[0] + aside - target[:2], axis=1)
        best = int(np.argmin(off + 1e-3 * np.abs(wrapped(ways[:, 0] - bevel))))
        return _Plan(float(ways[best, 0]), float(ways[best, 1] * total), float(ways[best, 2]))


@dataclass
class _Plan:
    first: float
    switch_ticks: float
    second: float
    age: int = 0


POLICIES: Dict[str, Any] = {"straight insertion": StraightInsertion, "bevel flip": BevelFlip,
                            "model predictive": ModelPredictive}


@dataclass
class Played:
    """Episodes, in the order of the environments and then of time."""
    error_mm: Array
    outcome: npt.NDArray[np.int64]
    ticks: npt.NDArray[np.int64]


def play(environment: VectorNeedleSteering, policy: Policy, episodes: int, seed: int) -> Played:
    """`episodes` of each environment from reset(seed=seed) on. With the same seed every policy has the same targets."""
    observations, info = environment.reset(seed=seed)
    n = environment.num_envs
    found: List[List[Tuple[float, int, int]]] = [[] for _ in range(n)]
    begun = np.zeros(n, dtype=np.int64)
    tick = 0
    while any(len(of_one) < episodes for of_one in found):
        observations, _, terminated, truncated, info = environment.step(policy(observations))
        tick += 1
        for i in np.flatnonzero(terminated | truncated):
            found[i].append((info["error_mm"][i], info["outcome"][i], tick - begun[i]))
            begun[i] = tick + 1  # the step that resets is none of the next episode
    columns = list(zip(*(episode for of_one in found for episode in of_one[:episodes])))
    return Played(np.array(columns[0]), np.array(columns[1]), np.array(columns[2]))
