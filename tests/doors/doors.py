"""The doors of brachyd for the tests that compare them: the native protocol over TCP and over WebSocket, packed from
net/protocol.json alone, brachyd.Client of apps/python, and OpenIGTLink with headers of version 1 and 2."""
import base64
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
for folder in ("scripts/ci", "apps/python", "tests/python"):
    sys.path.insert(0, str(ROOT / folder))
try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is missing")
    sys.exit(77)

import brachyd
from brachyd import wire
from waiting import DEADLINE_S
from wire_schema import Schema

SCHEMA = Schema()
ENUMS = SCHEMA.all["enums"]
ROLES = ENUMS["Role"]["values"]
ERRORS = ENUMS["ErrorCode"]["values"]
NO_MESH = SCHEMA.all["flags"]["Subscription"]["values"]["NO_MESH"]
ANY_NEEDLE = 0xffff
DEVICE_NAME = "a device"
NAN = float("nan")
# Of a scene that starts at once, and whose ticks leave the cores to the test.
SMALL = """
[tissue]
points = 600
phantom_surface_vertices = 150
[rates]
deformation_hz = 100
snapshot_hz = 20
"""


class Daemon:
    """brachyd with a scene, on free ports, in a folder of its own, which also has `files`; ended with the test."""

    def __init__(self, brachyd_path, scene, *more, config=None, files=None, http=True, igtl=True,
                 seconds=2 * DEADLINE_S):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        for name, content in (files or {}).items():
            (self.path / name).touch(mode=0o600)
            (self.path / name).write_bytes(content)
        if config is None:
            config = self.path / "scene.toml"
            config.write_text(scene, encoding="utf-8")
        options = [option.format(folder=self.path) for option in more]
        line = [brachyd_path, "--config", config, "--port", "0", "--duration", str(seconds), *options]
        line += ["--http-port", "0"] if http else []
        line += ["--igtl-port", "0"] if igtl else []
        self.log = (self.path / "log").open("w+", encoding="utf-8")
        self.process = subprocess.Popen(line, cwd=self.path, stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.ports = {}
        for name in ["native"] + ["http"] * http + ["igtl"] * igtl:
            said = self.process.stdout.readline()
            found = re.search(r":(\d+)/?\s*$", said)
            if not found:
                self.log.seek(0)
                raise AssertionError(f"brachyd said '{said}' where it names its port, {name}: {self.log.read()}")
            self.ports[name] = int(found[1])

    def __enter__(self):
        return self

    def __exit__(self, *ignored):
        self.process.terminate()
        self.process.wait(timeout=DEADLINE_S)
        self.process.stdout.close()
        self.log.close()
        self.folder.cleanup()


class Refused(Exception):
    """An ERROR, as any door gives it."""

    def __init__(self, code, reason, text, fatal=False):
        super().__init__(text)
        self.code, self.reason, self.text, self.fatal = code, reason, text, fatal


# --- the native protocol, of the schema alone ---


class Stream:
    """Bytes over TCP."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), DEADLINE_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, messages):
        try:
            self.socket.sendall(b"".join(messages))
        except (BrokenPipeError, ConnectionResetError):
            pass  # what the server says before it ends is read

    def receive(self):
        """b"" at the end."""
        try:
            return self.socket.recv(1 << 18)
        except ConnectionResetError:
            return b""

    def close(self):
        self.socket.close()


class WebSocketStream(Stream):
    """Each message one masked binary frame (RFC 6455)."""

    def __init__(self, port):
        super().__init__(port)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
                            f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n"
                            .encode())
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            more = super().receive()
            if not more:
                raise AssertionError(f"no upgrade: {self.data}")
            self.data += more
        head, _, self.data = self.data.partition(b"\r\n\r\n")
        assert b" 101 " in head, head

    def send(self, messages):
        frames = []
        for message in messages:
            size = len(message)
            if size < 126:
                head = struct.pack(">BB", 0x82, 0x80 | size)
            elif size < 1 << 16:
                head = struct.pack(">BBH", 0x82, 0x80 | 126, size)
            else:
                head = struct.pack(">BBQ", 0x82, 0x80 | 127, size)
            frames.append(head + bytes(4) + message)  # masked with 0
        super().send(frames)

    def receive(self):
        while True:
            if len(self.data) >= 2:
                size, at = self.data[1] & 127, 2
                if size >= 126:
                    at = 4 if size == 126 else 10
                    size = int.from_bytes(self.data[2:at], "big") if len(self.data) >= at else 1 << 62
                if len(self.data) >= at + size:
                    opcode, payload = self.data[0] & 15, self.data[at:at + size]
                    self.data = self.data[at + size:]
                    if opcode == 8:
                        return b""
                    if opcode in (0, 2):
                        return payload
                    continue
            more = super().receive()
            if not more:
                return b""
            self.data += more


class NativeDoor:
    """A client of the native protocol over TCP; over WebSocket with `stream`."""
    name = "native"
    port_of, stream = "native", Stream

    def __init__(self, daemon, role=None, needle=ANY_NEEDLE, token=None, name=DEVICE_NAME):
        """Without a role it says no HELLO. Raises Refused where the server does."""
        self.link = self.stream(daemon.ports[self.port_of])
        self.sent, self.data = 0, b""
        self.sections = {}  # of the message that came last
        if role is None:
            return
        limits = dict.fromkeys(("max_force_n", "max_stiffness_n_per_mm", "damping_n_s_per_mm", "rate_hz"), "nan")
        sections = {"DEVICE": {"needle": needle, "flags": 0}} if needle != ANY_NEEDLE else {}
        if token is not None:
            sections["TOKEN"] = {"token": token.hex()}
        hello = {"role": ROLES[role], "subscription": NO_MESH, "name": name, **limits}
        self.link.send([self.encode("HELLO", hello, sections)])
        try:
            self.wait(lambda kind, body: kind == "WELCOME")
        except Refused:
            self.close()
            raise

    def close(self):
        self.link.close()

    def encode(self, kind, body, sections=None, stamp_ns=None):
        self.sent += 1
        return SCHEMA.encode(kind, body, sections or {}, self.sent, stamp_ns or time.monotonic_ns())

    def raw(self, kind, body, version=1, length=None, skipped=0):
        """A message of any numbers."""
        self.sent += 1 + skipped
        return struct.pack("<4sHHIIQQ", b"BRCY", version, kind, 0, len(body) if length is None else length, self.sent,
                           time.monotonic_ns()) + body

    def request(self, kind, body, times=1):
        """The same request, `times` in one write."""
        self.link.send([self.encode(kind, body) for _ in range(times)])

    def pose(self, X_WN, stamp_ns, needle=0, times=1):
        """A pose: 3×4; several have ascending stamps."""
        rows = [[shown(number) for number in row] for row in X_WN]
        self.link.send([self.encode("POSE", {"needle": needle, "flags": 0, "X_WN": rows}, stamp_ns=stamp_ns + n)
                        for n in range(times)])

    def complete(self):
        """Name and body of all that have come whole; `sections` has that one's."""
        while len(self.data) >= 32 and len(self.data) >= 32 + struct.unpack("<I", self.data[12:16])[0]:
            size = 32 + struct.unpack("<I", self.data[12:16])[0]
            whole, self.data = self.data[:size], self.data[size:]
            header, body, self.sections = SCHEMA.decode(whole)
            name = SCHEMA.names[header["type"]]
            if name == "PING" and body["reply"] == 0:
                self.link.send([self.encode("PING", {"nonce": body["nonce"], "reply": 1, "received_ns": 0,
                                                     "echoed_stamp_ns": header["stamp_ns"]})])
            yield name, body

    def messages(self):
        """Name and body of all to come, until the server ends."""
        while True:
            yield from self.complete()
            more = self.link.receive()
            if not more:
                return
            self.data += more

    def wait(self, is_it, refused=lambda error: True):
        """Until a message of which is_it(name, body) holds. Raises Refused at an ERROR of which `refused` holds, and at
        every fatal one."""
        for name, body in self.messages():
            if name == "ERROR" and (body["fatal"] or refused(body)):
                raise Refused(body["code"], body["reason"], body["text"], bool(body["fatal"]))
            if is_it(name, body):
                return body
        raise AssertionError("the server ended the connection without a word")

    def refusal(self):
        """The next ERROR."""
        try:
            self.wait(lambda name, body: False)
        except Refused as refused:
            return refused
        return None

    def refusals_until(self, is_last):
        """All ERRORs up to one of which is_last(Refused) holds."""
        every = []
        while not every or not is_last(every[-1]):
            every.append(self.refusal())
        return every


class WebSocketDoor(NativeDoor):
    name = "WebSocket"
    port_of, stream = "http", WebSocketStream


# --- Python's client ---


def as_python(kind, body):
    """The request as a class of apps/python."""
    made = {"ARM": wire.Arm, "DROP": wire.Drop, "CONTROL": wire.Control, "SCANNER": wire.Scanner, "LOAD": wire.Load,
            "PLAN": wire.Plan, "CONTOUR": wire.Contour, "EXERCISE": wire.Exercise}[kind]
    body = {key: NAN if value == "nan" else value for key, value in body.items()}
    if kind == "PLAN":
        body["needles"] = [wire.PlanNeedle(**{key: NAN if value == "nan" else value for key, value in needle.items()})
                           for needle in body["needles"]]
    if kind == "CONTOUR":
        body["slices"] = [wire.ContourSlice(outline["slice"], outline["tick"], outline["probe_depth_mm"],
                                            np.vstack([outline["X_WI"], [0, 0, 0, 1]]), np.array(outline["points"]))
                          for outline in body["slices"]]
    return made(**body)


class PythonDoor:
    """brachyd.Client."""
    name = "Python"

    def __init__(self, daemon, role, needle=ANY_NEEDLE, token=None, name=DEVICE_NAME):
        hello = brachyd.Hello(brachyd.Role[role], name, brachyd.Subscription.NO_MESH, needle=needle, token=token)
        try:
            self.client = brachyd.Client(f"127.0.0.1:{daemon.ports['native']}", hello, timeout_s=DEADLINE_S)
        except brachyd.ServerError as error:
            raise Refused(error.error.code, error.error.reason, error.error.text, True) from error
        self.seen = 0

    def close(self):
        self.client.close()

    def request(self, kind, body, times=1):
        for _ in range(times):
            self.client.protocol.request(as_python(kind, body))
        self.client.flush()

    def pose(self, X_WN, stamp_ns, needle=0, times=1):
        for n in range(times):
            message = wire.Pose(needle, 0, np.vstack([X_WN, [0, 0, 0, 1]]))
            self.client.protocol.send(message.TYPE, message.encode(), stamp_ns + n)
        self.client.flush()

    def refusal(self):
        try:
            self.client.wait_for(lambda: len(self.client.errors) > self.seen, DEADLINE_S)
        except brachyd.ServerError as error:
            return Refused(error.error.code, error.error.reason, error.error.text, True)
        self.seen += 1
        error = self.client.errors[self.seen - 1]
        return Refused(error.code, error.reason, error.text)

    refusals_until = NativeDoor.refusals_until


# --- OpenIGTLink ---

IGTL_HEADER = struct.Struct(">H12s20sQQQ")
IGTL_HEADER_BYTES = IGTL_HEADER.size


def igtl_message(kind, device, body, version=1, timestamp=0, metadata=(), crc=0):
    """One message; CRC 0: the sender computes none."""
    if version >= 2:
        index = struct.pack(">H", len(metadata))
        for key, value in metadata:
            index += struct.pack(">HHI", len(key), 3, len(value))
        texts = "".join(key + value for key, value in metadata).encode()
        body = struct.pack(">HHII", 12, len(index), len(texts), 0) + body + index + texts
    return IGTL_HEADER.pack(version, kind.encode(), device.encode(), timestamp, len(body), crc) + body


def igtl_time(ns):
    """Of UTC ns: seconds in the high half, the fraction in the low one."""
    return (ns // 1_000_000_000 << 32) | ((ns % 1_000_000_000 << 32) // 1_000_000_000)


def igtl_transform(X):
    """The body of a TRANSFORM: column by column, single precision."""
    return struct.pack(">12f", *[X[row][column] for column in range(4) for row in range(3)])


class IgtlDoor:
    """A client of OpenIGTLink; a pose is a TRANSFORM, a request a STRING, or a COMMAND with `as_command`."""
    name = "OpenIGTLink"

    def __init__(self, daemon, as_command=False):
        self.socket = socket.create_connection(("127.0.0.1", daemon.ports["igtl"]), DEADLINE_S)
        self.data, self.as_command, self.commands = b"", as_command, 0

    def close(self):
        self.socket.close()

    def send(self, data):
        try:
            self.socket.sendall(data)
        except (BrokenPipeError, ConnectionResetError):
            pass

    def pose(self, X_WN, stamp_ns, needle=0, times=1, device=None, version=1, metadata=()):
        name = device or f"Needle{needle}ToRas"
        self.send(b"".join(igtl_message("TRANSFORM", name, igtl_transform(X_WN), version,
                                        igtl_time(stamp_ns + 1000 * n), metadata) for n in range(times)))

    def command(self, text, times=1):
        out = b""
        for _ in range(times):
            self.commands += 1
            content = text.encode()
            if self.as_command:
                body = struct.pack(">I128sHI", self.commands, b"", 3, len(content)) + content
                out += igtl_message("COMMAND", "Test", body, version=2)
            else:
                out += igtl_message("STRING", "Test", struct.pack(">HH", 3, len(content)) + content)
        self.send(out)

    def messages(self):
        """Type, device and body without its extended header, until the server ends."""
        while True:
            while len(self.data) >= IGTL_HEADER_BYTES:
                version, kind, device, _, size, _ = IGTL_HEADER.unpack(self.data[:IGTL_HEADER_BYTES])
                if len(self.data) < IGTL_HEADER_BYTES + size:
                    break
                body = self.data[IGTL_HEADER_BYTES:IGTL_HEADER_BYTES + size]
                self.data = self.data[IGTL_HEADER_BYTES + size:]
                if version >= 2:
                    head, index, texts, _ = struct.unpack(">HHII", body[:12])
                    body = body[head:len(body) - index - texts]
                yield kind.rstrip(b"\0").decode(), device.rstrip(b"\0").decode(), body
            try:
                more = self.socket.recv(1 << 18)
            except ConnectionResetError:
                return
            if not more:
                return
            self.data += more

    def refusal(self):
        """The next STATUS or RTS_COMMAND that says what was not done: STATUS's code is in `status`."""
        for kind, _, body in self.messages():
            if kind == "STATUS":
                status, sub_code = struct.unpack(">Hq", body[:10])
                if status != 1:
                    refused = Refused(sub_code, sub_code, body[30:].split(b"\0")[0].decode())
                    refused.status = status
                    return refused
            elif kind == "RTS_COMMAND":
                content = body[138:].decode()
                if 'success="true"' in content:
                    continue
                code = re.search(r'Name="Code" Value="(\d+)"', content)
                text = re.search(r'Name="Reason" Value="([^"]*)"', content)
                named = body[4:132].rstrip(b"\0").decode("utf-8", "ignore")
                said = text[1].replace("&lt;", "<").replace("&quot;", '"').replace("&amp;", "&")
                assert said.startswith(named), f"'{named}' in the name's place, and the reason '{said}'"
                refused = Refused(int(code[1]), 0, said)
                refused.status = 12
                return refused
        return None

    refusals_until = NativeDoor.refusals_until


def shown(number):
    """As the schema's packer takes it."""
    number = float(number)
    return "nan" if number != number else number
