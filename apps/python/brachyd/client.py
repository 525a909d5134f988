"""Clients over TCP, TLS and WebSocket: one that blocks, one for asyncio."""
from __future__ import annotations

import asyncio
import select
import socket
import ssl
import time
from typing import Any, AsyncIterator, Callable, List, Optional, Tuple

import numpy.typing as npt

from .constants import ControlAction
from .protocol import Protocol
from .websocket import BINARY, WebSocket, encode_frame
from .wire import Error, Force, Hello, Message, Scanner

READ_BYTES = 1 << 18


def websocket_of(address: str) -> Tuple[str, Optional[WebSocket]]:
    """HOST:PORT of ws://HOST:PORT, and the WebSocket to speak there; of any other address itself and None."""
    for scheme in ("ws://", "wss://"):
        if address.startswith(scheme):
            address = address[len(scheme):].rstrip("/")
            return address, WebSocket(*address_of(address))
    return address, None


def address_of(address: str) -> Tuple[str, int]:
    """Host and port of HOST:PORT; an IPv6 address stands in brackets."""
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdigit() or "://" in address:
        raise ValueError(f"needs HOST:PORT, such as 127.0.0.1:18950, not '{address}'")
    return host.strip("[]"), int(port)


def outgoing(protocol: Protocol, websocket: Optional[WebSocket]) -> bytes:
    """What waits to be sent."""
    if websocket is not None and not websocket.is_open:
        return b""  # the server has not answered the upgrade
    messages = protocol.take_outgoing()
    if websocket is None:
        return b"".join(messages)
    replies, websocket.replies = websocket.replies, []
    return b"".join(replies + [encode_frame(BINARY, message) for message in messages])


class Client:
    """A client that blocks: `with Client("127.0.0.1:18950", Hello(...)) as client`. One thread. "ws://HOST:PORT" speaks
    WebSocket to the HTTP port; give `tls` for TLS, also with wss://.

    poll() serves the connection and is to be called often: it answers PINGs, and a viewer drains its socket so that it
    shows the present. `client.protocol` holds what came last; `errors` the errors that were not fatal.
    """

    def __init__(self, address: str, hello: Optional[Hello] = None, tls: Optional[ssl.SSLContext] = None,
                 timeout_s: float = 10.0) -> None:
        address, self._websocket = websocket_of(address)
        host, port = address_of(address)
        self.protocol = Protocol(hello or Hello())
        self.errors: List[Error] = []
        plain = socket.create_connection((host, port), timeout_s)
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket: socket.socket = tls.wrap_socket(plain, server_hostname=host) if tls else plain
        try:
            if self._websocket:
                self._socket.sendall(self._websocket.upgrade)
            self.flush()
            self.wait_for(lambda: self.protocol.welcome is not None, timeout_s)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *ignored: Any) -> None:
        self.close()

    def close(self) -> None:
        self._socket.close()

    def flush(self) -> None:
        out = outgoing(self.protocol, self._websocket)
        if out:
            self._socket.sendall(out)

    def poll(self, timeout_s: float = 0.0) -> List[Message]:
        """Sends what waits, and reads what has come: waits for the first bytes at most that long. Throws ServerError,
        ProtocolError, ConnectionError."""
        self.flush()
        messages: List[Message] = []
        while self._is_readable(0.0 if messages else timeout_s):
            data = self._socket.recv(READ_BYTES)
            if not data:
                raise ConnectionError("the server closed the connection")
            messages += self.protocol.feed(self._websocket.feed(data) if self._websocket else data)
        self.errors += [message for message in messages if isinstance(message, Error)]
        self.flush()
        return messages

    def _is_readable(self, timeout_s: float) -> bool:
        if isinstance(self._socket, ssl.SSLSocket) and self._socket.pending():
            return True
        return bool(select.select([self._socket], [], [], timeout_s)[0])

    def wait_for(self, condition: Callable[[], bool], timeout_s: float = 10.0) -> None:
        """Polls until then. Throws TimeoutError."""
        end = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError("what was waited for did not come")
            self.poll(0.05)

    def send_pose(self, X_WN: npt.ArrayLike, stamp_ns: Optional[int] = None) -> int:
        """A pose (4×4, mm) at once; its sequence, which FORCE and FRAME echo."""
        sequence = self.protocol.send_pose(X_WN, stamp_ns)
        self.flush()
        return sequence

    def exchange(self, X_WN: npt.ArrayLike, timeout_s: float = 0.05) -> Optional[Force]:
        """Sends a pose and waits for the FORCE that answers it, or a later one; None: none came in that time."""
        sequence = self.send_pose(X_WN)
        end = time.monotonic() + timeout_s
        while (left := end - time.monotonic()) > 0:
            for message in reversed(self.poll(left)):
                if isinstance(message, Force) and message.input_sequence >= sequence:
                    return message
        return None

    def control(self, action: ControlAction, loop: bool = False, kernel: str = "",
                support_radius_mm: float = float("nan")) -> int:
        sequence = self.protocol.control(action, loop, kernel, support_radius_mm)
        self.flush()
        return sequence

    def set_scanner(self, scanner: Scanner) -> int:
        """As operator, or as the probe's device. What is in use then comes as protocol.scanner."""
        sequence = self.protocol.set_scanner(scanner)
        self.flush()
        return sequence


class AsyncClient:
    """The same for asyncio: `client = await AsyncClient.connect("127.0.0.1:18950")`, `async for message in client`."""

    def __init__(self, protocol: Protocol, reader: asyncio.StreamReader, writer: asyncio.StreamWriter,
                 websocket: Optional[WebSocket] = None) -> None:
        self.protocol = protocol
        self._websocket = websocket
        self._reader, self._writer = reader, writer
        self._waiting: List[Message] = []

    @classmethod
    async def connect(cls, address: str, hello: Optional[Hello] = None,
                      tls: Optional[ssl.SSLContext] = None) -> "AsyncClient":
        address, websocket = websocket_of(address)
        host, port = address_of(address)
        reader, writer = await asyncio.open_connection(host, port, ssl=tls, limit=READ_BYTES)
        client = cls(Protocol(hello or Hello()), reader, writer, websocket)
        if websocket:
            writer.write(websocket.upgrade)
        await client.flush()
        while client.protocol.welcome is None:
            client._waiting += await client._read()
        return client

    async def flush(self) -> None:
        out = outgoing(self.protocol, self._websocket)
        if out:
            self._writer.write(out)
            await self._writer.drain()

    async def _read(self) -> List[Message]:
        data = await self._reader.read(READ_BYTES)
        if not data:
            raise ConnectionError("the server closed the connection")
        messages = self.protocol.feed(self._websocket.feed(data) if self._websocket else data)
        await self.flush()
        return messages

    async def __aiter__(self) -> AsyncIterator[Message]:
        while True:
            for message in self._waiting:
                yield message
            self._waiting = await self._read()

    async def send_pose(self, X_WN: npt.ArrayLike, stamp_ns: Optional[int] = None) -> int:
        sequence = self.protocol.send_pose(X_WN, stamp_ns)
        await self.flush()
        return sequence

    async def close(self) -> None:
        self._writer.close()
        try:
            await self._writer.wait_closed()
        except (ConnectionError, ssl.SSLError):
            pass
