"""Forces beside the device, of LOCAL_MODEL and of FORCE (net/PROTOCOL.md): the same numbers, bit for bit, as the C++
headers haptics/force/local_force.h and received_force.h give. They calculate in the same order, so that a change there
is a change here; the test vectors in tests/haptics hold for both."""
from __future__ import annotations

import dataclasses
import math
from collections import deque
from typing import Deque, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .constants import ForceFlag
from .wire import Array, Force, LocalModel

IN_CONTACT, IS_CAPSULE = 1, 2
EXPIRED, NOT_FINITE, CLAMPED, SLEWED, STIFFNESS_LIMITED = 1, 2, 4, 8, 16  # bits of LocalForce.flags
DEFAULT_MAX_FORCE_N = 3.3
FARTHEST_MM = STIFFEST_N_PER_MM = LARGEST_LATERAL_N = 1e6
LONGEST_TIME_TO_LIVE_S = 5.0
MAX_SLEW_N_PER_MS = 0.5
LONGEST_SLEW_NS = 1_000_000
DEFAULT_VALID_NS = 50_000_000  # of a FORCE that states no validity
LONGEST_VALID_NS = 5_000_000_000
RAMP_NS = 500_000_000
TIPS = 512  # kept: half a second at 1 kHz

_Vector = Tuple[float, float, float]
_ZERO: _Vector = (0.0, 0.0, 0.0)


def _vector(values: npt.ArrayLike) -> _Vector:
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return x, y, z


def _dot(a: _Vector, b: _Vector) -> float:
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def _less(a: _Vector, b: _Vector) -> _Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _plus(a: _Vector, b: _Vector) -> _Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _times(factor: float, a: _Vector) -> _Vector:
    return factor * a[0], factor * a[1], factor * a[2]


def _clamp(value: float, low: float, high: float) -> float:
    return low if value < low else high if high < value else value


def _is_finite(values: Sequence[float]) -> bool:
    return all(map(math.isfinite, values))


def _is_place(p: _Vector) -> bool:
    return _is_finite(p) and max(abs(x) for x in p) <= FARTHEST_MM


def _elapsed_ns(since_ns: int, now_ns: int) -> int:
    return max(now_ns - since_ns, 0)


def is_usable(m: LocalModel) -> bool:
    """Whether an untrusted model can be evaluated; of what is infinite only its three bounds pass."""
    axis, lateral_n = _vector(m.axis), _vector(m.lateral_n)
    return (_is_place(_vector(m.reference_tip)) and _is_place(_vector(m.contact_point)) and _is_finite(axis)
            and _is_finite(lateral_n) and max(abs(x) for x in lateral_n) <= LARGEST_LATERAL_N
            and abs(_dot(axis, axis) - 1) < 1e-6
            and 0 <= m.axial_stiffness_n_per_mm <= STIFFEST_N_PER_MM
            and 0 <= m.lateral_stiffness_n_per_mm <= STIFFEST_N_PER_MM and math.isfinite(m.time_to_live_s)
            and m.axial_min_n <= 0 <= m.axial_max_n and m.after_puncture_n >= 0)


class ForceLimiter:
    """The last stage before the hand: the norm of the force at most `max_force_n`, its change at most 0.5 N/ms, no
    force before the second step. A limit that is no number above 0 gives no force, nor does a wanted one that is not
    finite."""

    def __init__(self, max_force_n: float = DEFAULT_MAX_FORCE_N) -> None:
        self.max_force_n = max_force_n
        self.clamped = self.slewed = False
        self._force_n = _ZERO
        self._last_ns: Optional[int] = None

    def step(self, wanted_n: npt.ArrayLike, now_ns: int) -> Array:
        """The force to render at `now_ns`, of any monotonic clock, where `wanted_n` is wanted."""
        most_n = self.max_force_n if self.max_force_n > 0 else 0.0
        wanted = _vector(wanted_n)
        is_number = math.isfinite(_dot(wanted, wanted))
        if not is_number:
            wanted = _ZERO
        size = math.sqrt(_dot(wanted, wanted))
        self.clamped = size > most_n or not is_number
        target = _times(most_n / size, wanted) if size > most_n else wanted
        since_ns = 0 if self._last_ns is None else min(_elapsed_ns(self._last_ns, now_ns), LONGEST_SLEW_NS)
        self._last_ns = now_ns
        change = _less(target, self._force_n)
        most, length = MAX_SLEW_N_PER_MS * 1e-6 * since_ns, math.sqrt(_dot(change, change))
        self.slewed = length > most
        self._force_n = _plus(self._force_n, _times(most / length, change)) if self.slewed else target
        return np.array(self._force_n)


class LocalForce:
    """The force on the needle, each cycle of the device:

        every cycle:       force_n = local.evaluate(tip, now_ns)
        at LOCAL_MODEL:    local.take(model, model.input_stamp_ns if model.input_sequence else None, now_ns)

    Finite, at most `max_force_n`, and it changes by at most 0.5 N/ms; limits that are no numbers above 0 give no force.
    Times are of one monotonic clock. `flags`: what the last evaluate() did (EXPIRED, NOT_FINITE, …).
    """

    def __init__(self, max_force_n: float = DEFAULT_MAX_FORCE_N, max_stiffness_n_per_mm: float = math.inf) -> None:
        self.max_stiffness_n_per_mm = max_stiffness_n_per_mm
        self.flags = 0
        self._limiter = ForceLimiter(max_force_n)
        self._model: Optional[LocalModel] = None  # as it came; what changes is below
        self._is_stiffness_limited = False
        self._arrived_ns = 0
        self._tips: Deque[Tuple[_Vector, int]] = deque(maxlen=TIPS)
        self._kept_point: Optional[_Vector] = None  # of the last model, if its stiffness was limited
        self._axis = self._point = self._reference = self._lateral_n = _ZERO

    @property
    def max_force_n(self) -> float:
        return self._limiter.max_force_n

    @max_force_n.setter
    def max_force_n(self, max_force_n: float) -> None:
        self._limiter.max_force_n = max_force_n

    @property
    def model(self) -> Optional[LocalModel]:
        """In use, with the contact point as dragged so far. None: there is none, or it had expired."""
        if self._model is None:
            return None
        return dataclasses.replace(self._model, contact_point=np.array(self._point))

    def take(self, model: LocalModel, pose_stamp_ns: Optional[int], now_ns: int) -> bool:
        """A model arrived, of the pose with that stamp. False: it is not usable, and the last one stays."""
        if not is_usable(model) or not self.max_stiffness_n_per_mm > 0:
            return False
        m = dataclasses.replace(model, time_to_live_s=min(model.time_to_live_s, LONGEST_TIME_TO_LIVE_S))
        self._model = m
        self._axis, self._point = _vector(m.axis), _vector(m.contact_point)
        self._reference, self._lateral_n = _vector(m.reference_tip), _vector(m.lateral_n)
        self._is_stiffness_limited = self._limit_stiffness(m)
        self._arrived_ns = now_ns
        if pose_stamp_ns is not None:
            for tip, stamp_ns in self._tips:
                if stamp_ns > pose_stamp_ns:
                    self._drag(m, tip)
        return True

    def evaluate(self, tip: npt.ArrayLike, now_ns: int, pose_stamp_ns: Optional[int] = None) -> Array:
        """The force (N, frame W) with the needle's tip (mm, frame W) there now. `pose_stamp_ns`: of its pose, where
        poses are stamped by another clock."""
        self.flags = 0
        wanted = self._wanted(_vector(tip), now_ns if pose_stamp_ns is None else pose_stamp_ns, now_ns)
        force_n = self._limiter.step(wanted, now_ns)
        self.flags |= CLAMPED * self._limiter.clamped | SLEWED * self._limiter.slewed
        return force_n

    def _wanted(self, tip: _Vector, pose_stamp_ns: int, now_ns: int) -> _Vector:
        if not _is_place(tip):
            self.flags |= NOT_FINITE
            return _ZERO
        if not self._tips or pose_stamp_ns > self._tips[-1][1]:
            self._tips.append((tip, pose_stamp_ns))
        m = self._model
        if m is not None and _elapsed_ns(self._arrived_ns, now_ns) > 1e9 * m.time_to_live_s:
            m = self._model = None
        if m is None:
            self.flags |= EXPIRED
            return _ZERO
        if self._is_stiffness_limited:
            self.flags |= STIFFNESS_LIMITED
        self._drag(m, tip)
        z = self._beyond(tip)
        if not (z > 0 if _only_pushes(m) else m.contact & IN_CONTACT):
            return _ZERO
        axial = _clamp(m.axial_stiffness_n_per_mm * z, m.axial_min_n, m.axial_max_n)
        moved = _less(tip, self._reference)
        across = _less(moved, _times(_dot(moved, self._axis), self._axis))
        return _less(_less(self._lateral_n, _times(m.lateral_stiffness_n_per_mm, across)), _times(axial, self._axis))

    def _beyond(self, tip: _Vector) -> float:
        return _dot(_less(tip, self._point), self._axis)

    def _drag(self, m: LocalModel, tip: _Vector) -> None:
        if not m.contact & (IN_CONTACT | IS_CAPSULE):
            return
        k, z = m.axial_stiffness_n_per_mm, self._beyond(tip)
        if k * z > m.axial_max_n:
            if m.contact & IS_CAPSULE:  # the capsule is through
                m.contact = (m.contact & ~IS_CAPSULE) | IN_CONTACT
                m.axial_max_n = min(m.axial_max_n, m.after_puncture_n)
            self._point = _plus(self._point, _times(max(z - m.axial_max_n / k, 0.0), self._axis))
        elif m.axial_min_n < 0 and k * z < m.axial_min_n:
            self._point = _plus(self._point, _times(z - m.axial_min_n / k, self._axis))

    def _limit_stiffness(self, m: LocalModel) -> bool:
        limit = self.max_stiffness_n_per_mm
        is_lateral, is_axial = m.lateral_stiffness_n_per_mm > limit, m.axial_stiffness_n_per_mm > limit
        if is_lateral:
            self._lateral_n = _times(limit / m.lateral_stiffness_n_per_mm, self._lateral_n)
            m.lateral_stiffness_n_per_mm = limit
        if is_axial:
            m.axial_stiffness_n_per_mm = limit
        if not (is_axial and m.contact & IN_CONTACT and not _only_pushes(m)):
            self._kept_point = None
            return is_axial or is_lateral
        if self._kept_point is not None:
            z = _dot(_less(self._reference, self._kept_point), self._axis)
            kept = _clamp(z, m.axial_min_n / limit, m.axial_max_n / limit)
            self._point = _less(self._reference, _times(kept, self._axis))
        self._kept_point = self._point
        return True


def _only_pushes(m: LocalModel) -> bool:
    return bool(m.contact & IS_CAPSULE) and m.axial_min_n == 0


class ReceivedForce:
    """The force to render of those that FORCE brings. One has a time to live: where no newer one comes, because the
    daemon stopped or cannot be reached, the force goes to 0 at 0.5 N/ms and stays there, latched.

        at FORCE:      received.take(force, now_ns)
        every cycle:   force_n = received.evaluate(now_ns)
        where ARM is sent:   received.arm()
        where the connection is lost:   received.lose()

    Finite, at most `max_force_n`, and it changes by at most 0.5 N/ms. Times are of one monotonic clock.
    """

    def __init__(self, max_force_n: float = DEFAULT_MAX_FORCE_N) -> None:
        self.is_latched = False
        self._limiter = ForceLimiter(max_force_n)
        self._force_n: Optional[_Vector] = None  # received and valid
        self._taken_ns, self._valid_ns = 0, DEFAULT_VALID_NS
        self._is_server_latched = self._is_ramping = False
        self._ramp_ns: Optional[int] = None

    def take(self, force: Force, now_ns: int) -> bool:
        """A FORCE arrived, valid for its valid_ms (0: not stated) from now on. False: it is not finite; the last one
        stays, and its time runs on."""
        is_latched = bool(force.flags & ForceFlag.LATCHED)
        return self.take_force(force.forces.force_n, force.valid_ms, is_latched, now_ns)

    def take_force(self, force_n: npt.ArrayLike, valid_ms: int, is_latched: bool, now_ns: int) -> bool:
        """The same of a message's fields."""
        own = _vector(force_n)
        if not _is_finite(own):
            return False
        self._check(now_ns)  # a force that comes too late does not revive the one before
        if self._is_server_latched and not is_latched:
            self._rearm()
        self._is_server_latched = is_latched
        self._force_n, self._taken_ns = own, now_ns
        self._valid_ns = DEFAULT_VALID_NS if valid_ms == 0 else min(valid_ms * 1_000_000, LONGEST_VALID_NS)
        return True

    def evaluate(self, now_ns: int) -> Array:
        """The force to render now, N. To be called each cycle."""
        self._check(now_ns)
        wanted = _ZERO
        if self._force_n is not None and not self.is_latched:
            wanted = _times(self._gain(now_ns), self._force_n)
        return self._limiter.step(wanted, now_ns)

    def lose(self) -> None:
        """The connection is lost: the force goes to 0 now and latches."""
        self.is_latched = self.is_latched or self._force_n is not None
        self._force_n = None

    def arm(self) -> None:
        """The user ends the latch. Without a latch it changes nothing."""
        if self.is_latched:
            self._rearm()

    def _check(self, now_ns: int) -> None:
        if self._force_n is not None and _elapsed_ns(self._taken_ns, now_ns) > self._valid_ns:
            self.lose()

    def _rearm(self) -> None:
        self.is_latched, self._force_n = False, None
        self._is_ramping, self._ramp_ns = True, None

    def _gain(self, now_ns: int) -> float:
        if not self._is_ramping:
            return 1.0
        if self._ramp_ns is None:
            self._ramp_ns = now_ns
        ns = _elapsed_ns(self._ramp_ns, now_ns)
        self._is_ramping = ns < RAMP_NS
        return float(ns) / float(RAMP_NS) if self._is_ramping else 1.0
