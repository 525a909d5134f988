"""Little-endian reading and writing of message bodies, for wire_generated.py; and a message's header."""
from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, List, Optional, Protocol, Tuple, Union

import numpy as np
import numpy.typing as npt

from .constants import MAGIC, PROTOCOL_VERSION

Array = npt.NDArray[np.float64]
FloatArray = npt.NDArray[np.float32]
IndexArray = npt.NDArray[np.uint32]
HEADER = struct.Struct("<IHHIIQQ")


class ProtocolError(Exception):
    """The other side broke net/PROTOCOL.md."""


class Writable(Protocol):
    """What writes itself."""

    def write(self, w: Writer) -> None:
        ...


def zeros(dtype: Any, *shape: int) -> npt.NDArray[Any]:
    return np.zeros(shape, dtype)


def eye() -> Array:
    return np.eye(4)


def boolean(value: int) -> bool:
    if value > 1:
        raise ProtocolError("a yes/no field is neither 0 nor 1")
    return value == 1


def checked(value: float, least: float, most: float, of: str, name: str) -> None:
    if not least <= value <= most:
        raise ProtocolError(f"{of}: {name} is {value}, not from {least} to {most}")


class Reader:
    """A body, read from its begin to its end. Throws ProtocolError where the bytes are too few."""

    def __init__(self, data: Union[bytes, memoryview]) -> None:
        self.data = memoryview(data)
        self.at = 0

    def take(self, count: int) -> memoryview:
        if self.at + count > len(self.data):
            raise ProtocolError("a body ends too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def get(self, form: str) -> Tuple[Any, ...]:
        return struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))

    def text(self) -> str:
        try:
            return bytes(self.take(self.get("H")[0])).decode("utf-8")
        except UnicodeDecodeError as error:
            raise ProtocolError("a text is not UTF-8") from error

    def numbers(self, dtype: Any, count: int) -> npt.NDArray[Any]:
        kind = np.dtype(dtype).newbyteorder("<")
        return np.frombuffer(self.take(kind.itemsize * count), kind).astype(dtype, copy=False)

    def rows(self, dtype: Any, count: int, width: int) -> npt.NDArray[Any]:
        return self.numbers(dtype, count * width).reshape(-1, width)

    def pose(self) -> Array:
        """4×4, mm."""
        X = np.eye(4)
        X[:3] = self.rows(np.float64, 3, 4)
        return X

    def fits(self, count: int, least_bytes: int) -> int:
        """A count that was read is believed only if that many entries can still follow."""
        if count * least_bytes > len(self.data) - self.at:
            raise ProtocolError("a count is larger than the body")
        return count

    def sections(self) -> Iterator[Tuple[int, Reader]]:
        """Number and content of each; a caller skips those that it does not know."""
        count, _ = self.get("HH")
        for _ in range(count):
            number, _, length = self.get("HHI")
            yield number, Reader(self.take(length))

    def skip_sections(self) -> None:
        for _ in self.sections():
            pass

    def finish(self) -> None:
        if self.at != len(self.data):
            raise ProtocolError("a body is too long")


class Writer:
    def __init__(self) -> None:
        self.data = bytearray()

    def put(self, form: str, *values: Any) -> None:
        self.data += struct.pack("<" + form, *values)

    def text(self, text: str) -> None:
        data = text.encode("utf-8")
        self.put("H", len(data))
        self.data += data

    def texts(self, texts: Iterable[str]) -> None:
        for text in texts:
            self.text(text)

    def raw(self, data: bytes, size: Optional[int] = None) -> None:
        if size is not None and len(data) != size:
            raise ValueError(f"{len(data)} bytes, not {size}")
        self.data += data

    def array(self, values: npt.ArrayLike, dtype: Any, width: int) -> None:
        array = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
        if array.size % width:
            raise ValueError(f"{array.size} numbers, not a multiple of {width}")
        self.data += array.tobytes()

    def pose(self, X: npt.ArrayLike) -> None:
        """X: 4×4 or 3×4, mm."""
        matrix = np.ascontiguousarray(np.asarray(X, dtype="<f8")[:3, :4])
        if matrix.shape != (3, 4):
            raise ValueError("a pose is a 4×4 or 3×4 matrix")
        self.data += matrix.tobytes()

    def each(self, items: Iterable[Writable]) -> None:
        for item in items:
            item.write(self)

    def sections(self, sections: List[Tuple[int, Any]]) -> None:
        """Number and content of those that are not None."""
        present = [(number, section) for number, section in sections if section is not None]
        self.put("HH", len(present), 0)
        for number, section in present:
            inside = Writer()
            section.write(inside)
            self.put("HHI", number, 0, len(inside.data))
            self.data += inside.data


@dataclass
class Header:
    type: int
    length: int
    sequence: int
    stamp_ns: int


def decode_header(data: Union[bytes, memoryview]) -> Header:
    magic, version, kind, _, length, sequence, stamp = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise ProtocolError("this is no brachyd message: the magic is wrong")
    if version != PROTOCOL_VERSION:
        raise ProtocolError(f"the server speaks version {version}, this client {PROTOCOL_VERSION}")
    return Header(kind, length, sequence, stamp)


def encode_message(kind: int, body: bytes, sequence: int, stamp_ns: int) -> bytes:
    return HEADER.pack(MAGIC, PROTOCOL_VERSION, kind, 0, len(body), sequence, stamp_ns) + body
