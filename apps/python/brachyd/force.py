"""LOCAL_MODEL's force beside the device: the formula of net/PROTOCOL.md, as haptics/force/local_force.h has it."""
from __future__ import annotations

import dataclasses
import math
from collections import deque
from typing import Deque, Optional, Tuple

import numpy as np
import numpy.typing as npt

from .wire import Array, LocalModel

IN_CONTACT, IS_CAPSULE = 1, 2
FARTHEST_MM = STIFFEST_N_PER_MM = LARGEST_LATERAL_N = 1e6
LONGEST_TIME_TO_LIVE_S = 5.0
LONGEST_SLEW_NS = 1_000_000
TIPS = 512  # kept: half a second at 1 kHz


def is_usable(m: LocalModel) -> bool:
    """Whether an untrusted model can be evaluated; of what is infinite only its three bounds pass."""
    places = np.concatenate([m.reference_tip, m.contact_point])
    vectors = np.concatenate([places, m.axis, m.lateral_n])
    return bool(np.isfinite(vectors).all() and np.abs(places).max() <= FARTHEST_MM
                and np.abs(m.lateral_n).max() <= LARGEST_LATERAL_N and abs(m.axis @ m.axis - 1) < 1e-6
                and 0 <= m.axial_stiffness_n_per_mm <= STIFFEST_N_PER_MM
                and 0 <= m.lateral_stiffness_n_per_mm <= STIFFEST_N_PER_MM and math.isfinite(m.time_to_live_s)
                and m.axial_min_n <= 0 <= m.axial_max_n and m.after_puncture_n >= 0)


class LocalForce:
    """The force on the needle, each cycle of the device:

        every cycle:       force_n = local.evaluate(tip, now_ns)
        at LOCAL_MODEL:    local.take(model, model.input_stamp_ns if model.input_sequence else None, now_ns)

    Finite, at most `max_force_n`, and it changes by at most 0.5 N/ms. Times are of one monotonic clock.
    """

    def __init__(self, max_force_n: float = 3.3, max_stiffness_n_per_mm: float = math.inf) -> None:
        self.max_force_n = max_force_n
        self.max_stiffness_n_per_mm = max_stiffness_n_per_mm
        self.model: Optional[LocalModel] = None
        self._arrived_ns = 0
        self._tips: Deque[Tuple[Array, int]] = deque(maxlen=TIPS)
        self._force_n: Array = np.zeros(3)
        self._last_ns: Optional[int] = None
        self._kept_point: Optional[Array] = None  # of the last model, if its stiffness was limited

    def take(self, model: LocalModel, pose_stamp_ns: Optional[int], now_ns: int) -> bool:
        """A model arrived, of the pose with that stamp. False: it is not usable, and the last one stays."""
        if not is_usable(model) or not self.max_stiffness_n_per_mm > 0:
            return False
        self.model = dataclasses.replace(model, time_to_live_s=min(model.time_to_live_s, LONGEST_TIME_TO_LIVE_S))
        self._limit_stiffness(self.model)
        self._arrived_ns = now_ns
        if pose_stamp_ns is not None:
            for tip, stamp_ns in self._tips:
                if stamp_ns > pose_stamp_ns:
                    self._drag(tip)
        return True

    def evaluate(self, tip: npt.ArrayLike, now_ns: int) -> Array:
        """The force (N, frame W) with the needle's tip (mm, frame W) there now."""
        wanted = self._wanted(np.asarray(tip, dtype=float), now_ns)
        size = math.sqrt(wanted @ wanted)
        target = wanted * (self.max_force_n / size) if size > self.max_force_n else wanted
        since_ns = 0 if self._last_ns is None else min(max(now_ns - self._last_ns, 0), LONGEST_SLEW_NS)
        self._last_ns = now_ns
        change = target - self._force_n
        most, length = 0.5e-6 * since_ns, math.sqrt(change @ change)
        self._force_n = self._force_n + change * (most / length) if length > most else target
        return self._force_n.copy()

    def _wanted(self, tip: Array, now_ns: int) -> Array:
        if not (np.isfinite(tip).all() and np.abs(tip).max() <= FARTHEST_MM):
            return np.zeros(3)
        if not self._tips or now_ns > self._tips[-1][1]:
            self._tips.append((tip.copy(), now_ns))
        if self.model is not None and now_ns - self._arrived_ns > 1e9 * self.model.time_to_live_s:
            self.model = None
        m = self.model
        if m is None:
            return np.zeros(3)
        self._drag(tip)
        z = float((tip - m.contact_point) @ m.axis)
        only_pushes = m.contact & IS_CAPSULE and m.axial_min_n == 0
        if not (z > 0 if only_pushes else m.contact & IN_CONTACT):
            return np.zeros(3)
        axial = min(max(m.axial_stiffness_n_per_mm * z, m.axial_min_n), m.axial_max_n)
        moved = tip - m.reference_tip
        across = moved - (moved @ m.axis) * m.axis
        force_n: Array = m.lateral_n - m.lateral_stiffness_n_per_mm * across - axial * m.axis
        return force_n

    def _drag(self, tip: Array) -> None:
        m = self.model
        if m is None or not m.contact & (IN_CONTACT | IS_CAPSULE):
            return
        k, z = m.axial_stiffness_n_per_mm, float((tip - m.contact_point) @ m.axis)
        if k * z > m.axial_max_n:
            if m.contact & IS_CAPSULE:  # the capsule is through
                m.contact = (m.contact & ~IS_CAPSULE) | IN_CONTACT
                m.axial_max_n = min(m.axial_max_n, m.after_puncture_n)
            m.contact_point = m.contact_point + max(z - m.axial_max_n / k, 0.0) * m.axis
        elif m.axial_min_n < 0 and k * z < m.axial_min_n:
            m.contact_point = m.contact_point + (z - m.axial_min_n / k) * m.axis

    def _limit_stiffness(self, m: LocalModel) -> None:
        limit = self.max_stiffness_n_per_mm
        if m.lateral_stiffness_n_per_mm > limit:
            m.lateral_n = m.lateral_n * (limit / m.lateral_stiffness_n_per_mm)
            m.lateral_stiffness_n_per_mm = limit
        is_axial = m.axial_stiffness_n_per_mm > limit
        if is_axial:
            m.axial_stiffness_n_per_mm = limit
        only_pushes = m.contact & IS_CAPSULE and m.axial_min_n == 0
        if not (is_axial and m.contact & IN_CONTACT and not only_pushes):
            self._kept_point = None
            return
        if self._kept_point is not None:
            z = float((m.reference_tip - self._kept_point) @ m.axis)
            kept = min(max(z, m.axial_min_n / limit), m.axial_max_n / limit)
            m.contact_point = m.reference_tip - kept * m.axis
        self._kept_point = m.contact_point
