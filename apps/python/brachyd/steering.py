"""An environment for needle steering as Gymnasium has it, whether that is installed or not: a step is one tick.

A needle with a bevel bends on its way in; turning it about its shaft steers it. The task: bring its tip to a target.
"""
from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from os import PathLike
from typing import Any, Dict, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from .reach import INSERTED, Reach, measure, pose_at
from .simulator import Simulator, slices_of
from .spaces import Box, Env

Array = npt.NDArray[np.float64]
# A 20 G needle through the template, whose bevel leads it aside as far as its beam's small angles hold (8°).
SCENE = """
[tissue]
points = 1500
phantom_surface_vertices = 400
[needle]
flexible = true
gauge = 20
bevel_force_share = 0.3
guide_at = "template"
"""
FIELDS = (("to_target_mm", 3),  # from the tip to the target, at rest
          ("target_mm", 3),  # at rest
          ("hole_mm", 2),  # x and y of the line on which the hand goes
          ("bevel", 2),  # where the bevel leads the tip: x, y, unit
          ("hand_mm", 1),  # how far the hand has pushed since the reset
          ("time_share", 1))  # of most_s


class Outcome(enum.IntEnum):
    """Why an episode ended."""
    RUNNING = 0
    AT_DEPTH = 1  # the tip has come to the target's depth: terminated
    ORGAN = 2  # the needle has come into an organ: terminated
    TIME = 3  # most_s have passed: truncated


@dataclass(frozen=True)
class SteeringSettings:
    """Lengths in mm, at rest."""
    scene: Optional[Union[str, "PathLike[str]"]] = None  # a scene's file
    text: Optional[str] = None  # or its text; neither: SCENE
    holes_mm: Tuple[Tuple[float, float], ...] = ((10, 0), (-10, 0), (5, 5), (-5, 5), (10, -5), (-10, -5))
    speed_mm_s: float = 20  # of the hand, at most
    roll_deg_s: float = 360  # at most
    most_s: float = 20  # simulated time of an episode
    margin_mm: float = 5  # of targets from the tissue's surface
    organ_margin_mm: float = 2  # of targets from organs
    shallowest_share: float = 0.5  # of the depths that the needle can reach, below which no target is
    reach_share: float = 0.9  # of the radius that the needle can reach, within which targets are
    organ_penalty_mm: float = 10  # taken from the reward where the needle comes into an organ

    def simulator(self) -> Simulator:
        text = SCENE if self.scene is None and self.text is None else self.text
        return Simulator(self.scene, text=text)


class NeedleSteering(Env):
    """One needle through a hole along +z, which can be pushed, drawn back and turned.

    Action (2 numbers, −1 … 1): speed along the needle, of at most `speed_mm_s`; turning, of at most `roll_deg_s`.
    Observation (float64): a row of numbers, all finite; `observation_fields` has the place of each by name: FIELDS, and
    then the engine's tick (Simulator.observation_fields).

    Targets are material points, given at rest, and the tip's error is that of its material point, as a seed's that
    falls there. They lie in a disc that the needle can reach (Reach), within the tissue and away from organs.
    Reward of a tick: by how much the tip came nearer, mm. An episode ends when the tip's material point has come
    as deep as the target; the reward then is less by the error. The hand's depth does not end it: the tip lags behind.
    In `info`: `error_mm`, the tip's distance from the target now, and `outcome`, an Outcome.

    Deterministic: the same seed and actions give the same bits. Threads: one. `like`, `reach`: of another environment
    of the same settings, so that neither the model nor the reach is made again.
    Errors: ValueError for a scene or hole that cannot be used, and for actions that are no finite numbers.
    """

    def __init__(self, settings: SteeringSettings = SteeringSettings(), *, reach: Optional[Reach] = None,
                 like: Optional["NeedleSteering"] = None) -> None:
        self.settings = settings
        self.simulator: Simulator = Simulator(like=like.simulator) if like else settings.simulator()
        known = reach or (like.reach if like else None)
        self.reach: Reach = known or measure(self.simulator, settings.holes_mm, settings.margin_mm)
        self.observation_fields = slices_of(FIELDS)
        own = sum(size for _, size in FIELDS)
        engine = self.simulator.observation_fields
        self.observation_fields.update({name: slice(own + at.start, own + at.stop) for name, at in engine.items()})
        size = max(at.stop for at in self.observation_fields.values())
        self.observation_space = Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = Box(-1.0, 1.0, (2,), np.float32)
        self.advance_mm = settings.speed_mm_s * self.simulator.period_s
        self.turn_rad = math.radians(settings.roll_deg_s) * self.simulator.period_s
        self.most_ticks = round(settings.most_s / self.simulator.period_s)
        self.use_row(np.zeros(size))
        self.hole, self.target, self.outcome = 0, np.zeros(3), Outcome.RUNNING
        self.start_mm, self.hand_mm, self.roll_rad, self.ticks, self.error_mm = 0.0, 0.0, 0.0, 0, 0.0

    def use_row(self, row: Array) -> None:
        """From now on observations are written into `row`, which may be memory that processes share."""
        self.row = row
        self._engine_row = row[sum(size for _, size in FIELDS):]
        self._contact, self._passes, self._tip = (self.observation_fields[name].start
                                                  for name in ("contact", "organ_passes", "tip_rest_mm"))
        self._tip_row = row[self._tip:self._tip + 3]

    def reset(self, *, seed: Optional[int] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Array, Dict[str, Any]]:
        """The tissue at rest, the needle in front of it, its bevel to any side. `options`: `hole`, an index in
        settings.holes_mm; `target_mm`, 3 numbers, wherever they are."""
        options = dict(options or {})
        hole, target = options.pop("hole", None), options.pop("target_mm", None)
        if options:
            raise ValueError(f"reset knows no option {', '.join(options)}; it has hole and target_mm")
        if hole is not None and hole not in range(len(self.settings.holes_mm)):
            raise ValueError(f"hole {hole}: settings.holes_mm has {len(self.settings.holes_mm)}")
        super().reset(seed=seed)
        self.hole = int(self.np_random.integers(len(self.settings.holes_mm)))
        self.roll_rad = float(self.np_random.uniform(-np.pi, np.pi))
        if hole is not None:
            self.hole = int(hole)
        self.target = self._reachable_target() if target is None else np.array(target, dtype=np.float64)
        if self.target.shape != (3,) or not np.isfinite(self.target).all():
            raise ValueError("target_mm: 3 finite numbers, mm")
        self.simulator.reset()
        self.hand_mm = self.start_mm = float(self.reach.start_mm[self.hole])
        self.pose = pose_at(self.settings.holes_mm[self.hole], self.hand_mm, self.roll_rad)
        self._target: Tuple[float, ...] = tuple(self.target.tolist())
        self.row[self.observation_fields["hole_mm"]] = self.settings.holes_mm[self.hole]
        self.row[self.observation_fields["target_mm"]] = self.target
        self.ticks, self.outcome = 0, Outcome.RUNNING
        self._tick()
        return self.row.copy(), self._info()

    def step(self, action: npt.ArrayLike) -> Tuple[Array, float, bool, bool, Dict[str, Any]]:
        advance, turn = np.asarray(action, dtype=np.float64).tolist()
        reward, terminated, truncated = self.advance(advance, turn)
        return self.row.copy(), reward, terminated, truncated, self._info()

    def advance(self, advance: float, turn: float) -> Tuple[float, bool, bool]:
        """A step without copies: reward, terminated, truncated; the observation is in `row`."""
        if not (math.isfinite(advance) and math.isfinite(turn)):
            raise ValueError("an action is two finite numbers, −1 … 1")
        self.hand_mm = max(self.start_mm, self.hand_mm + min(max(advance, -1.0), 1.0) * self.advance_mm)
        self.roll_rad += min(max(turn, -1.0), 1.0) * self.turn_rad
        self.ticks += 1
        before = self.error_mm
        self._tick()
        reward, row = before - self.error_mm, self.row
        if row[self._passes] > 0:
            self.outcome = Outcome.ORGAN
            reward -= self.settings.organ_penalty_mm + self.error_mm
        elif row[self._contact] == INSERTED and row[self._tip + 2] >= self._target[2]:
            self.outcome = Outcome.AT_DEPTH
            reward -= self.error_mm
        elif self.ticks >= self.most_ticks:
            self.outcome = Outcome.TIME
        return reward, self.outcome in (Outcome.AT_DEPTH, Outcome.ORGAN), self.outcome == Outcome.TIME

    def _tick(self) -> None:
        """One tick with the needle where hand and roll have it, and its observation."""
        c, s = math.cos(self.roll_rad), math.sin(self.roll_rad)
        pose, row = self.pose, self.row
        pose[0, 0] = pose[1, 1] = c
        pose[1, 0], pose[0, 1], pose[2, 3] = s, -s, self.hand_mm
        self.simulator.step(pose)
        self.simulator.observe(0, self._engine_row)
        bevel = self.roll_rad + self.reach.bevel_rad
        x, y, z = self._tip_row.tolist()
        to = (self._target[0] - x, self._target[1] - y, self._target[2] - z)
        self.error_mm = math.sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2])
        row[0], row[1], row[2] = to
        row[8], row[9] = math.cos(bevel), math.sin(bevel)
        row[10], row[11] = self.hand_mm - self.start_mm, self.ticks / self.most_ticks

    def _info(self) -> Dict[str, Any]:
        return {"error_mm": self.error_mm, "outcome": int(self.outcome)}

    def _reachable_target(self) -> Array:
        depths = self.reach.depths(self.hole)
        shallowest = depths[0] + self.settings.shallowest_share * (depths[-1] - depths[0])
        for _ in range(1000):
            z, share, angle = self.np_random.uniform([shallowest, 0, 0], [depths[-1], 1, 2 * np.pi]).tolist()
            middle, radius = self.reach.disc(self.hole, z)
            off = self.settings.reach_share * float(radius) * math.sqrt(share)
            target = np.array([middle[0] + off * math.cos(angle), middle[1] + off * math.sin(angle), z])
            inside = self.simulator.depths_of(target[None])
            if (inside.pop("tissue")[0] >= self.settings.margin_mm
                    and all(depth[0] <= -self.settings.organ_margin_mm for depth in inside.values())):
                return target
        raise ValueError(f"hole {self.settings.holes_mm[self.hole]} mm: no target in 1,000 tries is "
                         f"{self.settings.margin_mm} mm inside the tissue and away from organs; choose other margins "
                         "or holes")
