"""WebSocket (RFC 6455) as brachyd speaks it: each message one binary frame, client to server masked."""
from __future__ import annotations

import base64
import hashlib
import os
import struct
from typing import List, Optional, Tuple

from .wire import ProtocolError

CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0, 1, 2, 8, 9, 10
LARGEST_REPLY = 16 * 1024


def masked(data: bytes, key: bytes) -> bytes:
    number = int.from_bytes(data, "little")
    repeated = (key * (len(data) // 4 + 1))[:len(data)]
    return (number ^ int.from_bytes(repeated, "little")).to_bytes(len(data), "little")


def encode_frame(opcode: int, payload: bytes) -> bytes:
    """One unfragmented, masked frame."""
    size = len(payload)
    head = bytes([0x80 | opcode])
    if size < 126:
        head += bytes([0x80 | size])
    elif size < 1 << 16:
        head += struct.pack(">BH", 0x80 | 126, size)
    else:
        head += struct.pack(">BQ", 0x80 | 127, size)
    key = os.urandom(4)
    return head + key + masked(payload, key)


class WebSocket:
    """A client's end without a socket: the upgrade, then frames. feed() returns the bytes of binary messages."""

    def __init__(self, host: str, port: int) -> None:
        self._key = base64.b64encode(os.urandom(16)).decode()
        name = f"[{host}]" if ":" in host else host
        self.upgrade = (f"GET /ws HTTP/1.1\r\nHost: {name}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                        f"Sec-WebSocket-Key: {self._key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode()
        self.is_open = False
        self._buffer = bytearray()
        self.replies: List[bytes] = []  # to be sent: answers to pings and to a close

    def feed(self, data: bytes) -> bytes:
        self._buffer += data
        if not self.is_open and not self._read_upgrade():
            return b""
        out = b""
        while True:
            frame = self._next_frame()
            if frame is None:
                return out
            opcode, payload = frame
            if opcode in (BINARY, CONTINUATION):
                out += payload
            elif opcode == PING:
                self.replies.append(encode_frame(PONG, payload))
            elif opcode == CLOSE:
                self.replies.append(encode_frame(CLOSE, payload[:2]))
            elif opcode == TEXT:
                raise ProtocolError("a text message from the server")

    def _read_upgrade(self) -> bool:
        head, end, rest = bytes(self._buffer).partition(b"\r\n\r\n")
        if not end:
            if len(self._buffer) > LARGEST_REPLY:
                raise ProtocolError("no HTTP reply")
            return False
        lines = head.decode("latin-1").split("\r\n")
        fields = [line.partition(":") for line in lines[1:]]
        headers = {name.strip().lower(): value.strip() for name, _, value in fields}
        digest = hashlib.sha1((self._key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()
        if " 101 " not in lines[0] + " ":
            raise ConnectionError(f"no WebSocket: {lines[0]}")
        if headers.get("sec-websocket-accept") != base64.b64encode(digest).decode():
            raise ProtocolError("the WebSocket's reply does not answer this request")
        self._buffer = bytearray(rest)
        self.is_open = True
        return True

    def _next_frame(self) -> Optional[Tuple[int, bytes]]:
        if len(self._buffer) < 2:
            return None
        opcode, size, at = self._buffer[0] & 15, self._buffer[1] & 127, 2
        if self._buffer[1] & 0x80:
            raise ProtocolError("a masked frame from the server")
        form = {126: ">H", 127: ">Q"}.get(size)
        if form is not None:
            if len(self._buffer) < at + struct.calcsize(form):
                return None
            size = struct.unpack_from(form, self._buffer, at)[0]
            at += struct.calcsize(form)
        if len(self._buffer) < at + size:
            return None
        payload = bytes(self._buffer[at:at + size])
        del self._buffer[:at + size]
        return opcode, payload
