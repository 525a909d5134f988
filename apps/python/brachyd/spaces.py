"""Gymnasium's spaces and base classes where it is installed; else the little of them that the environments use."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Optional, Tuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


class Box:
    """Arrays of one shape and type, each number between a lower and an upper limit, which may be infinite."""

    def __init__(self, low: npt.ArrayLike, high: npt.ArrayLike, shape: Optional[Tuple[int, ...]] = None,
                 dtype: Any = np.float32) -> None:
        self.dtype = np.dtype(dtype)
        self.shape = tuple(shape) if shape is not None else np.broadcast(low, high).shape
        self.low: Array = np.broadcast_to(np.asarray(low, dtype=self.dtype), self.shape).copy()
        self.high: Array = np.broadcast_to(np.asarray(high, dtype=self.dtype), self.shape).copy()
        self._random = np.random.default_rng()

    def seed(self, seed: Optional[int] = None) -> None:
        self._random = np.random.default_rng(seed)

    def sample(self) -> Array:
        """Uniform where both limits are finite, else normal within them."""
        is_bounded = np.isfinite(self.low) & np.isfinite(self.high)
        low, high = np.where(is_bounded, self.low, 0.0), np.where(is_bounded, self.high, 0.0)
        free = np.clip(self._random.normal(size=self.shape), self.low, self.high)
        return np.where(is_bounded, self._random.uniform(low, high), free).astype(self.dtype)

    def contains(self, x: Any) -> bool:
        return (isinstance(x, np.ndarray) and np.can_cast(x.dtype, self.dtype) and x.shape == self.shape
                and bool(np.all(x >= self.low)) and bool(np.all(x <= self.high)))

    def __contains__(self, x: Any) -> bool:
        return self.contains(x)

    def __eq__(self, other: object) -> bool:
        return (isinstance(other, Box) and self.shape == other.shape and self.dtype == other.dtype
                and np.array_equal(self.low, other.low) and np.array_equal(self.high, other.high))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Box({self.low.min()}, {self.high.max()}, {self.shape}, {self.dtype})"


class Env:
    metadata: Dict[str, Any] = {"render_modes": []}
    render_mode: Optional[str] = None
    spec: Any = None
    action_space: Any
    observation_space: Any

    _np_random: Optional[np.random.Generator] = None

    @property
    def unwrapped(self) -> Any:
        return self

    @property
    def np_random(self) -> np.random.Generator:
        """Of the last seed; Gymnasium's gives the same numbers."""
        if self._np_random is None:
            self._np_random = np.random.default_rng()
        return self._np_random

    def reset(self, *, seed: Optional[int] = None, options: Optional[Dict[str, Any]] = None) -> Any:
        """Takes the seed; what it gives is the environment's own business."""
        if seed is not None:
            self._np_random = np.random.default_rng(seed)

    def close(self) -> None:
        """There is nothing to close."""


class VectorEnv(Env):
    num_envs: int
    single_action_space: Any
    single_observation_space: Any
    closed = False

    def close(self, **kwargs: Any) -> None:
        if not self.closed:
            self.close_extras(**kwargs)
            self.closed = True

    def close_extras(self, **kwargs: Any) -> None:
        """Of the class that has something to close."""


NEXT_STEP: Any = "NextStep"
if not TYPE_CHECKING:
    try:
        from gymnasium import Env
        from gymnasium.spaces import Box
        from gymnasium.vector import VectorEnv
    except ImportError:
        pass
    try:
        from gymnasium.vector import AutoresetMode  # from Gymnasium 1.1 on
        NEXT_STEP = AutoresetMode.NEXT_STEP
    except ImportError:
        pass


def of_many(space: Any, n: int) -> Any:
    """The space of n arrays of `space` in one, n×…"""
    return Box(np.repeat(space.low[None], n, 0), np.repeat(space.high[None], n, 0), dtype=space.dtype)
