#!/usr/bin/env python3
"""An environment for needle steering in the way of Gymnasium, which need not be installed: reset() and step().

A needle with a bevel bends on its way in; turning it about its shaft steers it. The task: bring the tip to a target in
the gland and leave a seed there. Run alone, it compares a needle that is only pushed, one that is turned at random and
one that a rule of one line steers.

usage: needle_steering.py [EPISODES]
"""
import sys
from typing import Any, Callable, Dict, Optional, Tuple

import numpy as np
import numpy.typing as npt

import brachyd

Array = npt.NDArray[np.float64]
SCENE = """
[tissue]
points = 1500
phantom_surface_vertices = 400
[needle]
flexible = true
bevel_force_share = 0.5
"""


class NeedleSteering:
    """Observation (9 numbers): from the tip to the target in the hand's frame x, y, z (mm), the tip's direction in it
    x, y, the roll's sine and cosine, the axial force (N), depth of the hand (mm). Action (2 numbers, −1 … 1): the speed
    along the needle, of at most `speed_mm_s`, and the turning, of at most `roll_deg_s`.

    Reward of a step: by how much the tip came nearer to the target, mm. An episode ends when the hand has reached the
    target's depth: a seed falls, and the reward is minus its distance at rest from the target, which is what `brachy
    score` reports of a seed. It is truncated after `most_steps`.
    """

    observation_size, action_size = 9, 2

    def __init__(self, scene: str = SCENE, ticks_per_step: int = 20, speed_mm_s: float = 20.0,
                 roll_deg_s: float = 180.0, most_steps: int = 200) -> None:
        self.simulator = brachyd.Simulator(text=scene)
        self.ticks, self.most_steps = ticks_per_step, most_steps
        self.advance_mm = speed_mm_s * self.simulator.period_s
        self.turn_rad = np.deg2rad(roll_deg_s) * self.simulator.period_s
        low = float(self.simulator.rest_positions[:, 2].min())
        self.start_mm = low - 10.0
        self.random = np.random.default_rng(0)
        self.target: Array = np.zeros(3)

    def reset(self, *, seed: Optional[int] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Array, Dict[str, Any]]:
        if seed is not None:
            self.random = np.random.default_rng(seed)
        self.simulator.reset()
        self.hand_mm, self.roll_rad, self.steps = self.start_mm, 0.0, 0
        wanted = (options or {}).get("target")
        self.target = np.asarray(wanted if wanted is not None
                                 else [*self.random.uniform(-3, 3, 2), self.random.uniform(5, 10)])
        self._advance(np.zeros(2), 1)
        self.distance_mm = self._error()
        return self._observe(), {"target": self.target}

    def step(self, action: npt.ArrayLike) -> Tuple[Array, float, bool, bool, Dict[str, Any]]:
        self._advance(np.clip(np.asarray(action, dtype=np.float64), -1, 1), self.ticks)
        self.steps += 1
        distance_mm = self._error()
        reward, self.distance_mm = self.distance_mm - distance_mm, distance_mm
        terminated = self.hand_mm >= self.target[2]
        info: Dict[str, Any] = {"tip_error_mm": distance_mm}
        if terminated:
            fallen = self.simulator.drop(self._poses(np.zeros(2), 1)[0])
            info["seed_error_mm"] = float(np.linalg.norm(fallen[0].rest - self.target)) if fallen else 20.0
            reward -= info["seed_error_mm"]
        return self._observe(), float(reward), bool(terminated), self.steps >= self.most_steps, info

    def _poses(self, action: Array, ticks: int) -> Array:
        """X_WN of the next ticks, t×4×4: the hand goes along +z and turns about it."""
        at = np.arange(1, ticks + 1)
        roll = self.roll_rad + at * action[1] * self.turn_rad
        X = np.tile(np.eye(4), (ticks, 1, 1))
        X[:, 0, 0] = X[:, 1, 1] = np.cos(roll)
        X[:, 1, 0], X[:, 0, 1] = np.sin(roll), -np.sin(roll)
        X[:, 2, 3] = self.hand_mm + at * action[0] * self.advance_mm
        return X

    def _advance(self, action: Array, ticks: int) -> None:
        self.simulator.run(self._poses(action, ticks))
        self.hand_mm += ticks * action[0] * self.advance_mm
        self.roll_rad += ticks * action[1] * self.turn_rad

    def _tip(self) -> Tuple[Array, Array]:
        """Where the tip is, and its direction."""
        needle = self.simulator.needles[0]
        if needle.shape is None:
            return needle.X_WN[:3, 3], needle.X_WN[:3, 2]
        along = (needle.shape[-1] - needle.shape[-2]).astype(np.float64)
        return needle.shape[-1].astype(np.float64), along / np.linalg.norm(along)

    def _error(self) -> float:
        return float(np.linalg.norm(self._tip()[0] - self.target))

    def _observe(self) -> Array:
        tip, along = self._tip()
        needle = self.simulator.needles[0]
        force = needle.forces.axial_n if needle.forces is not None else 0.0
        return np.array([*(self.target - tip), along[0], along[1], np.sin(self.roll_rad), np.cos(self.roll_rad), force,
                         self.hand_mm - self.start_mm])


def straight(observation: Array) -> Array:
    """Only pushes."""
    return np.array([1.0, 0.0])


def steered(observation: Array) -> Array:
    """Turns the bevel's side towards where the target lies across the needle."""
    to_target, roll = observation[:2], np.arctan2(observation[5], observation[6])
    off = np.angle(np.exp(1j * (np.arctan2(to_target[1], to_target[0]) - roll)))
    return np.array([0.5, np.clip(2 * off, -1, 1)])


def play(environment: NeedleSteering, policy: Callable[[Array], Array], seed: int) -> Tuple[float, float]:
    """One episode: its reward in all, and the seed's error, mm."""
    observation, _ = environment.reset(seed=seed)
    total, is_over = 0.0, False
    info: Dict[str, Any] = {}
    while not is_over:
        observation, reward, terminated, truncated, info = environment.step(policy(observation))
        total += reward
        is_over = terminated or truncated
    return total, float(info.get("seed_error_mm", np.nan))


def main(episodes: int) -> None:
    environment = NeedleSteering()
    chance = np.random.default_rng(1)
    policies = {"straight": straight, "random": lambda _: np.array([0.5, chance.uniform(-1, 1)]), "steered": steered}
    for name, policy in policies.items():
        played = np.array([play(environment, policy, seed) for seed in range(episodes)])
        print(f"{name:9} reward {played[:, 0].mean():7.2f}   seed error {played[:, 1].mean():5.2f} mm")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    main(int(sys.argv[1]) if len(sys.argv) == 2 else 5)
