"""What messages mean beyond their fields: class XView is the base of the class X in wire_generated.py."""
from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, List, Optional

import numpy as np
import numpy.typing as npt

from .constants import ANY_NEEDLE, FrameFlag, ImageFlag, SeedFlag
from .wire_bytes import Array, FloatArray, ProtocolError

if TYPE_CHECKING:
    from .wire_generated import (DoseSections, Forces, FrameCertificate, FrameSections, Needle, Seed, StateSections,
                                 WelcomeLimits, WelcomeSections)


class WelcomeView:
    sections: WelcomeSections

    @property
    def needle(self) -> int:
        """The device's; ANY_NEEDLE of other roles."""
        return self.sections.device.needle if self.sections.device else ANY_NEEDLE

    @property
    def needle_count(self) -> int:
        return self.sections.device.needle_count if self.sections.device else 1

    @property
    def limits(self) -> Optional[WelcomeLimits]:
        """What was negotiated with a device."""
        return self.sections.limits


class TopologyView:
    """The first `surface_vertex_count` points are the surface's."""
    rest_positions: FloatArray

    @property
    def rest(self) -> FloatArray:
        """Points at rest, n×3, mm."""
        return self.rest_positions


class NeedleView:
    """With what FRAME's sections say of it."""
    forces: Optional[Forces] = None
    input_sequence: int = 0
    input_stamp_ns: int = 0
    tip_depth_mm: float = 0.0
    shape: Optional[FloatArray] = None  # of a needle that bends: points hub … tip, n×3


class SeedView:
    flags: SeedFlag

    @property
    def is_certified(self) -> bool:
        """The field that it fell in was certified injective."""
        return SeedFlag.CERTIFIED in self.flags


class FrameView:
    frame_flags: FrameFlag
    needles: List[Needle]
    sections: FrameSections

    def after_read(self) -> None:
        by_id = {needle.id: needle for needle in self.needles}
        for entry in self.sections.force.entries if self.sections.force else []:
            if entry.needle not in by_id:
                raise ProtocolError("a force of a needle that is not in the FRAME")
            needle = by_id[entry.needle]
            needle.forces, needle.tip_depth_mm = entry.forces, entry.tip_depth_mm
            needle.input_sequence, needle.input_stamp_ns = entry.input_sequence, entry.input_stamp_ns
        for shape in self.sections.needle_shapes.entries if self.sections.needle_shapes else []:
            if shape.needle not in by_id:
                raise ProtocolError("a shape of a needle that is not in the FRAME")
            by_id[shape.needle].shape = shape.points

    @property
    def is_full(self) -> bool:
        return FrameFlag.FULL in self.frame_flags

    @property
    def seeds(self) -> List[Seed]:
        """Those that are new or have moved; all of them in a full frame."""
        return self.sections.seeds.entries if self.sections.seeds else []

    @property
    def seed_count(self) -> int:
        return self.sections.seeds.seed_count if self.sections.seeds else 0

    @property
    def certificate(self) -> Optional[FrameCertificate]:
        return self.sections.certificate

    @property
    def lag_mm(self) -> Optional[float]:
        """How far the points of this frame's mesh lag behind its tick's field, at most, mm. None: not known."""
        return self.sections.lag.lag_mm if self.sections.lag else None


class StateView:
    sections: StateSections

    @property
    def kernel(self) -> str:
        return self.sections.controls.kernel if self.sections.controls else ""

    @property
    def support_radius_mm(self) -> float:
        return self.sections.controls.support_radius_mm if self.sections.controls else 0.0

    @property
    def control_flags(self) -> int:
        return self.sections.controls.flags if self.sections.controls else 0


class DoseView:
    sections: DoseSections

    @property
    def surface_gy(self) -> Optional[FloatArray]:
        """At each surface vertex at rest; NaN: not known."""
        return self.sections.at_surface.surface_gy if self.sections.at_surface else None


class ImageView:
    """An ultrasound image. `pixels`: height×width gray values (uint8), row 0 farthest from the probe. X_WI (4×4, mm)
    maps (column · spacing, row · spacing, 0) to the world W."""
    flags: ImageFlag
    width: int
    height: int
    image_sequence: int
    spacing_mm: float
    X_WI: Array
    data: bytes
    pixels: npt.NDArray[np.uint8]

    def after_read(self) -> None:
        size = self.width * self.height
        data = inflated(self.data, size) if ImageFlag.ZLIB in self.flags else self.data
        if len(data) != size:
            raise ProtocolError("an image has not as many pixels as its size says")
        self.pixels = np.frombuffer(data, np.uint8).reshape(self.height, self.width)

    @property
    def sequence(self) -> int:
        return self.image_sequence

    def place(self, column: npt.ArrayLike, row: npt.ArrayLike) -> Array:
        """Where pixels are in W, mm: …×3."""
        at = np.stack(np.broadcast_arrays(np.asarray(column, float), np.asarray(row, float)), axis=-1)
        return np.asarray(at @ (self.spacing_mm * self.X_WI[:3, :2].T) + self.X_WI[:3, 3], dtype=np.float64)


def inflated(data: bytes, size: int) -> bytes:
    """Exactly `size` bytes, of a server that is not trusted."""
    stream = zlib.decompressobj()
    try:
        out = stream.decompress(data, size + 1)
    except zlib.error as error:
        raise ProtocolError(f"an image's pixels are damaged: {error}") from error
    if len(out) != size or not stream.eof or stream.unused_data:
        raise ProtocolError("an image has not as many pixels as its size says")
    return out
