"""Recordings of `brachy record`: "Recording file" in net/PROTOCOL.md."""
from __future__ import annotations

import os
import struct
import zlib
from typing import Iterator, Tuple, Union

from . import wire
from .constants import HEADER_BYTES
from .wire import Header, Message

MAGIC = b"BRCYREC1"


class Recording:
    """Iterates over (header, message). A file that was cut or damaged is good up to there: `end` says why it ended."""

    def __init__(self, file: Union[str, "os.PathLike[str]"]) -> None:
        self.file = file
        self.end = ""

    def __iter__(self) -> Iterator[Tuple[Header, Message]]:
        with open(self.file, "rb") as data:
            if data.read(len(MAGIC)) != MAGIC:
                raise wire.ProtocolError(f"{os.fspath(self.file)} is no recording")
            while True:
                at = data.tell()
                head = data.read(HEADER_BYTES)
                if not head:
                    self.end = ""
                    return
                if len(head) < HEADER_BYTES:
                    self.end = f"cut off at byte {at}"
                    return
                header = wire.decode_header(head)
                body = data.read(header.length)
                crc = data.read(4)
                if len(body) < header.length or len(crc) < 4:
                    self.end = f"cut off at byte {at}"
                    return
                if struct.unpack("<I", crc)[0] != zlib.crc32(head + body):
                    self.end = f"damaged at byte {at}"
                    return
                message = wire.decode(header.type, body)
                if message is not None:
                    yield header, message
