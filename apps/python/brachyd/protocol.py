"""The protocol's state without a socket: bytes in, messages out, and bytes to send. Both clients use it."""
from __future__ import annotations

import time
from typing import Dict, List, Optional

import numpy as np
import numpy.typing as npt

from . import wire
from .constants import HEADER_BYTES, ControlAction, MessageType
from .wire import (Dose, Error, FloatArray, Frame, Hello, Image, Message, Ping, Plan, ProtocolError, Scanner, Scene,
                   Seed, State, Topology, Welcome)

LARGEST_BODY = 1 << 30


class ServerError(Exception):
    """The server refused or ended the connection; `error` has its code."""

    def __init__(self, error: Error) -> None:
        super().__init__(error.text)
        self.error = error


class Protocol:
    """One connection. What has come last is in the attributes; feed() returns each message."""

    def __init__(self, hello: Hello) -> None:
        if hello.token is not None and len(hello.token) != 32:
            raise ValueError("a token has 32 bytes")
        self.hello = hello
        self.welcome: Optional[Welcome] = None
        self.topology: Optional[Topology] = None
        self.scene: Optional[Scene] = None
        self.state: Optional[State] = None
        self.dose: Optional[Dose] = None
        self.frame: Optional[Frame] = None
        self.images: Dict[int, Image] = {}  # the newest by ScannerArray
        self.scanner: Optional[Scanner] = None
        self.plan: Optional[Plan] = None  # in use, with Subscription.PLAN
        self.seeds: Dict[int, Seed] = {}
        self.mesh_tick = 0
        self._positions: Optional[FloatArray] = None
        self._buffer = bytearray()
        self._received = self._sent = 0
        self._out: List[bytes] = []
        self.send(MessageType.HELLO, hello.encode())

    @property
    def positions(self) -> FloatArray:
        """The mesh as it is, n×3, mm, frame W: a view that cannot be written, and that the next FRAME changes."""
        if self._positions is None:
            raise RuntimeError("no FRAME has come yet")
        view = self._positions.view()
        view.flags.writeable = False
        return view

    @property
    def needle(self) -> int:
        if self.welcome is None:
            raise RuntimeError("no WELCOME has come yet")
        return self.welcome.needle

    # --- out ---

    def send(self, kind: int, body: bytes, stamp_ns: Optional[int] = None) -> int:
        """Queues a message; its header's sequence."""
        self._sent += 1
        stamp = time.monotonic_ns() if stamp_ns is None else stamp_ns
        self._out.append(wire.encode_message(kind, body, self._sent, stamp))
        return self._sent

    def send_pose(self, X_WN: npt.ArrayLike, stamp_ns: Optional[int] = None) -> int:
        return self.send(MessageType.POSE, wire.encode_pose(self.needle, X_WN), stamp_ns)

    def request_state(self) -> None:
        self.send(MessageType.STATE, b"")

    def request(self, message: wire.Request) -> int:
        return self.send(message.TYPE, message.encode())

    def arm(self, needle: int) -> int:
        return self.request(wire.Arm(needle))

    def press(self, needle: int, pressed: bool) -> int:
        return self.request(wire.Drop(needle, pressed))

    def control(self, action: ControlAction, loop: bool = False, kernel: str = "",
                support_radius_mm: float = wire.NOT_STATED) -> int:
        return self.send(MessageType.CONTROL, wire.encode_control(action, loop, kernel, support_radius_mm))

    def set_scanner(self, scanner: Scanner) -> int:
        return self.request(scanner)

    def ping(self) -> None:
        self.send(MessageType.PING, Ping(self._sent + 1, False, 0, 0).encode())

    def take_outgoing(self) -> List[bytes]:
        """The messages that wait to be sent, each whole."""
        out, self._out = self._out, []
        return out

    # --- in ---

    def feed(self, data: bytes) -> List[Message]:
        """Messages that these bytes complete. Throws ProtocolError, and ServerError for a fatal ERROR."""
        self._buffer += data
        messages: List[Message] = []
        at = 0
        while len(self._buffer) - at >= HEADER_BYTES:
            header = wire.decode_header(bytes(self._buffer[at:at + HEADER_BYTES]))
            if header.length > LARGEST_BODY:
                raise ProtocolError("a body of over 1 GiB")
            end = at + HEADER_BYTES + header.length
            if end > len(self._buffer):
                break
            body = bytes(self._buffer[at + HEADER_BYTES:end])
            at = end
            self._received += 1
            if header.sequence != self._received:
                raise ProtocolError(f"message {self._received} has the sequence {header.sequence}")
            message = wire.decode(header.type, body)
            if message is not None:
                self._take(message, header.stamp_ns)
                messages.append(message)
        del self._buffer[:at]
        return messages

    def _take(self, message: Message, stamp_ns: int) -> None:
        if isinstance(message, Ping):
            if not message.reply:
                self.send(MessageType.PING, Ping(message.nonce, True, stamp_ns, time.monotonic_ns()).encode())
        elif isinstance(message, Frame):
            self._apply(message)
        elif isinstance(message, Error):
            if message.fatal:
                raise ServerError(message)
        elif isinstance(message, Welcome):
            self.welcome = message
        elif isinstance(message, Topology):
            self.topology = message
            self._positions = message.rest.copy()
        elif isinstance(message, Scene):
            self.scene = message
        elif isinstance(message, State):
            self.state = message
        elif isinstance(message, Dose):
            self.dose = message
        elif isinstance(message, Image):
            self.images[message.array] = message
        elif isinstance(message, Scanner):
            self.scanner = message
        elif isinstance(message, Plan):
            self.plan = message

    def _apply(self, frame: Frame) -> None:
        if self.topology is None or self._positions is None or frame.topology_hash != self.topology.hash:
            raise ProtocolError("a FRAME of another topology")
        if not frame.is_full and frame.base_tick > self.mesh_tick:
            raise ProtocolError("changes since a tick that this mesh does not have")
        if frame.is_full:
            self.seeds.clear()
        at = 0
        for first, count in frame.ranges.tolist():
            if first + count > len(self._positions):
                raise ProtocolError("a FRAME's range is outside the mesh")
            self._positions[first:first + count] = frame.positions[at:at + count]
            at += count
        for seed in frame.seeds:
            self.seeds[seed.id] = seed
        self.mesh_tick = frame.tick
        self.frame = frame


def unit_pose(tip: npt.ArrayLike) -> wire.Array:
    """A needle along +z with its tip there, mm: 4×4."""
    X = np.eye(4)
    X[:3, 3] = tip
    return X
