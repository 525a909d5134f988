"""Clients over TCP, TLS and WebSocket: one that blocks, one for asyncio."""
from __future__ import annotations

import asyncio
import select
import socket
import ssl
import time
from collections import deque
from typing import Any, AsyncIterator, Callable, Deque, List, Optional, Tuple

import numpy.typing as npt

from .constants import ControlAction
from .protocol import Protocol
from .websocket import BINARY, WebSocket, encode_frame
from .wire import Error, Force, Hello, Message, Request, Scanner

READ_BYTES = 1 << 18


def endpoint_of(address: str, tls: Optional[ssl.SSLContext]
                ) -> Tuple[str, int, Optional[WebSocket], Optional[ssl.SSLContext]]:
    """Host, port, the WebSocket to speak there (None: the native protocol alone), and the TLS to speak it in. With
    wss:// there is always one: the system's certificate authorities where `tls` names no others."""
    for scheme in ("ws://", "wss://"):
        if address.startswith(scheme):
            host, port = address_of(address[len(scheme):].rstrip("/"))
            if scheme == "wss://" and tls is None:
                tls = ssl.create_default_context()
            return host, port, WebSocket(host, port), tls
    host, port = address_of(address)
    return host, port, None, tls


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
    WebSocket to the HTTP port. `tls` for TLS; "wss://HOST:PORT" without it takes the system's certificate authorities.

    poll() serves the connection and is to be called often: it answers PINGs, and a viewer drains its socket so that it
    shows the present. `client.protocol` holds what came last; `errors` the errors that were not fatal.
    """

    def __init__(self, address: str, hello: Optional[Hello] = None, tls: Optional[ssl.SSLContext] = None,
                 timeout_s: float = 10.0) -> None:
        host, port, self._websocket, tls = endpoint_of(address, tls)
        self.protocol = Protocol(hello or Hello())
        self.errors: List[Error] = []
        plain = socket.create_connection((host, port), timeout_s)
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self._socket: socket.socket = tls.wrap_socket(plain, server_hostname=host) if tls else plain
        except BaseException:
            plain.close()
            raise
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

    def request(self, message: Request) -> int:
        """Sends any request of the protocol, such as wire.Load(0, 3); its sequence, which an Error in `errors` that
        refuses it names as about_sequence."""
        sequence = self.protocol.request(message)
        self.flush()
        return sequence

    def control(self, action: ControlAction, loop: bool = False, kernel: str = "",
                support_radius_mm: float = float("nan")) -> int:
        sequence = self.protocol.control(action, loop, kernel, support_radius_mm)
        self.flush()
        return sequence

    def arm(self, needle: Optional[int] = None) -> int:
        """Ends a latch of the needle's force: of the device's own, or, as operator, of any. The force then comes in
        over 0.5 s."""
        sequence = self.protocol.arm(self.protocol.needle if needle is None else needle)
        self.flush()
        return sequence

    def press(self, pressed: bool, needle: Optional[int] = None) -> int:
        """The button of the needle's device, which drops a seed when it goes down."""
        sequence = self.protocol.press(self.protocol.needle if needle is None else needle, pressed)
        self.flush()
        return sequence

    def set_scanner(self, scanner: Scanner) -> int:
        """As operator, or as the probe's device. What is in use then comes as protocol.scanner."""
        sequence = self.protocol.set_scanner(scanner)
        self.flush()
        return sequence


class AsyncClient:
    """The same for asyncio: `async with await AsyncClient.connect("127.0.0.1:18950") as client`, `async for message in
    client`. PINGs are answered while it is iterated over: leave the loop and it goes on where it was, but a client that
    does not come back to it within the server's silence_timeout is closed.
    """

    def __init__(self, protocol: Protocol, reader: asyncio.StreamReader, writer: asyncio.StreamWriter,
                 websocket: Optional[WebSocket] = None) -> None:
        self.protocol = protocol
        self.errors: List[Error] = []
        self._websocket = websocket
        self._reader, self._writer = reader, writer
        self._waiting: Deque[Message] = deque()

    @classmethod
    async def connect(cls, address: str, hello: Optional[Hello] = None, tls: Optional[ssl.SSLContext] = None,
                      timeout_s: float = 10.0) -> "AsyncClient":
        """Throws as Client; asyncio.TimeoutError where no WELCOME comes in that time."""
        host, port, websocket, tls = endpoint_of(address, tls)

        async def begin() -> "AsyncClient":
            reader, writer = await asyncio.open_connection(host, port, ssl=tls, limit=READ_BYTES)
            client = cls(Protocol(hello or Hello()), reader, writer, websocket)
            try:
                if websocket:
                    writer.write(websocket.upgrade)
                await client.flush()
                while client.protocol.welcome is None:
                    await client._read()
            except BaseException:
                writer.close()
                raise
            return client

        return await asyncio.wait_for(begin(), timeout_s)

    async def __aenter__(self) -> "AsyncClient":
        return self

    async def __aexit__(self, *ignored: Any) -> None:
        await self.close()

    async def flush(self) -> None:
        out = outgoing(self.protocol, self._websocket)
        if out:
            self._writer.write(out)
            await self._writer.drain()

    async def _read(self) -> None:
        data = await self._reader.read(READ_BYTES)
        if not data:
            raise ConnectionError("the server closed the connection")
        messages = self.protocol.feed(self._websocket.feed(data) if self._websocket else data)
        self.errors += [message for message in messages if isinstance(message, Error)]
        self._waiting.extend(messages)
        await self.flush()

    async def __aiter__(self) -> AsyncIterator[Message]:
        while True:
            while self._waiting:
                yield self._waiting.popleft()
            await self._read()

    async def send_pose(self, X_WN: npt.ArrayLike, stamp_ns: Optional[int] = None) -> int:
        sequence = self.protocol.send_pose(X_WN, stamp_ns)
        await self.flush()
        return sequence

    async def request(self, message: Request) -> int:
        """As Client's."""
        sequence = self.protocol.request(message)
        await self.flush()
        return sequence

    async def control(self, action: ControlAction, loop: bool = False, kernel: str = "",
                      support_radius_mm: float = float("nan")) -> int:
        sequence = self.protocol.control(action, loop, kernel, support_radius_mm)
        await self.flush()
        return sequence

    async def arm(self, needle: Optional[int] = None) -> int:
        sequence = self.protocol.arm(self.protocol.needle if needle is None else needle)
        await self.flush()
        return sequence

    async def close(self) -> None:
        self._writer.close()
        try:
            await self._writer.wait_closed()
        except (ConnectionError, ssl.SSLError):
            pass
