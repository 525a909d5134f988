"""Bytes to messages and back: net/PROTOCOL.md. Lengths mm, forces N, times s or ns, frame W = patient RAS.

The codecs are in wire_generated.py, what fields mean beyond that in wire_views.py; these are the names of programs.
"""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, Dict, Optional, Union, get_args

import numpy.typing as npt

from . import wire_generated
from .constants import (ANY_NEEDLE, ControlAction, DeviceFlag, ImageRequestFlag, MessageType, PlayFlag, Role,
                        Subscription)
from .wire_bytes import (HEADER, Array, FloatArray, Header, ProtocolError, Reader, Writer, decode_header,
                         encode_message)
from .wire_generated import (Arm, Contour, ContourSlice, Control, Dose, Drop, Error, Event, Exercise, Force, Forces,
                             Frame, HelloDevice, HelloImages, HelloSections, HelloSoftware, HelloToken, Image, Load,
                             LocalModel, Needle, Ping, Plan, PlanNeedle, PlannedNeedle, PlannedSeed, Pose, Quantiles,
                             Refusal, Scanner, Scene, Seed, State, StructureDose, Topology, Welcome)
from .wire_generated import FrameCertificate as Certificate
from .wire_generated import SceneStructure as Structure
from .wire_generated import ServerMessage as Message
from .wire_generated import WelcomeLimits as Limits

__all__ = ["Arm", "Array", "Certificate", "Contour", "ContourSlice", "DECODERS", "Dose", "Drop", "Error", "Event",
           "Exercise", "FloatArray", "Force", "Forces", "Frame", "HEADER", "Header", "Hello", "Image", "Limits", "Load",
           "LocalModel", "Message", "NOT_STATED", "Needle", "Ping", "Plan", "PlanNeedle", "PlannedNeedle",
           "PlannedSeed", "Pose", "ProtocolError", "Quantiles", "Reader", "Refusal", "Request", "Scanner", "Scene",
           "Seed", "State", "Structure", "StructureDose", "Topology", "Welcome", "Writer", "decode", "decode_header",
           "encode_control", "encode_message", "encode_pose"]
NOT_STATED = math.nan
Request = Union[Arm, Contour, Control, Drop, Exercise, Load, Plan, Pose, Scanner]


@dataclass
class Hello:
    """Who connects. NaN: not stated; the server then takes a default."""
    role: Role = Role.VIEWER
    name: str = "python"
    subscription: Subscription = Subscription(0)
    max_force_n: float = NOT_STATED
    max_stiffness_n_per_mm: float = NOT_STATED
    damping_n_s_per_mm: float = NOT_STATED
    rate_hz: float = NOT_STATED
    needle: int = ANY_NEEDLE
    evaluates_local_model: bool = False
    token: Optional[bytes] = None
    software: str = ""
    takes_zlib: bool = False  # pixels of images may come compressed

    def encode(self) -> bytes:
        flags = DeviceFlag.EVALUATES_LOCAL_MODEL if self.evaluates_local_model else DeviceFlag(0)
        sections = HelloSections(
            HelloDevice(self.needle, flags) if self.needle != ANY_NEEDLE or flags else None,
            HelloToken(self.token) if self.token is not None else None,
            HelloSoftware(self.software) if self.software else None,
            HelloImages(ImageRequestFlag.TAKES_ZLIB) if self.takes_zlib else None)
        return wire_generated.Hello(self.role, self.subscription, self.max_force_n, self.max_stiffness_n_per_mm,
                                    self.damping_n_s_per_mm, self.rate_hz, self.name, sections).encode()


# Of the messages that a server sends.
DECODERS: Dict[int, Callable[[Reader], Message]] = {message.TYPE: message.read for message in get_args(Message)}


def check_numbers(message: Message) -> None:
    """Throws ProtocolError where a number of FORCE or LOCAL_MODEL is not finite; of the latter's bounds: is NaN."""
    if isinstance(message, Force):
        f = message.forces
        numbers = [*f.force_n, *f.tip_torque_nmm, *f.hub_torque_nmm, f.axial_n, f.lateral_n, f.cutting_n, f.friction_n]
    elif isinstance(message, LocalModel):
        m = message
        numbers = [*m.reference_tip, *m.contact_point, *m.axis, *m.lateral_n, m.axial_stiffness_n_per_mm,
                   m.lateral_stiffness_n_per_mm, m.time_to_live_s, m.max_force_n, m.max_stiffness_n_per_mm,
                   m.max_slew_n_per_ms, m.ramp_s]
        if any(math.isnan(bound) for bound in (m.axial_min_n, m.axial_max_n, m.after_puncture_n)):
            raise ProtocolError("a bound of the force is NaN")
    else:
        return
    if not all(map(math.isfinite, numbers)):
        raise ProtocolError("a force is not finite")


def decode(kind: int, body: Union[bytes, memoryview]) -> Optional[Message]:
    """A message of a server; None: its type is of a later version. Throws ProtocolError for a body that is damaged in
    whatever way, and for a message that only a client may send."""
    read = DECODERS.get(kind)
    if read is None:
        if kind in wire_generated.MESSAGES:
            raise ProtocolError(f"only a client sends a {MessageType(kind).name}")
        return None
    reader = Reader(body)
    try:
        message = read(reader)
        reader.finish()
        check_numbers(message)
    except ProtocolError:
        raise
    except Exception as error:  # of what the bytes are taken for: enumerations, texts, sizes
        name = MessageType(kind).name
        raise ProtocolError(f"a {name} is damaged: {type(error).__name__}: {error}") from error
    return message


def encode_pose(needle: int, X_WN: npt.ArrayLike) -> bytes:
    """X_WN: 4×4 or 3×4, needle to world, mm."""
    w = Writer()
    w.put("H6x", needle)
    w.pose(X_WN)
    return bytes(w.data)


def encode_control(action: ControlAction, loop: bool = False, kernel: str = "",
                   support_radius_mm: float = NOT_STATED) -> bytes:
    return Control(action, PlayFlag.LOOP if loop else PlayFlag(0), support_radius_mm, kernel).encode()
