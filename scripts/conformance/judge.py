"""What the conversations share: the client as a child process, the judge's end of a connection, and the verdicts."""
import json
import pathlib
import queue
import re
import socket
import struct
import subprocess
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/ci"))
from wire_schema import Schema  # pylint: disable=wrong-import-position

SCHEMA = Schema()
DOCUMENT = re.sub(r"\s+", " ", (ROOT / "net/PROTOCOL.md").read_text(encoding="utf-8"))
HEADER = struct.Struct("<4sHHIIQQ")
# No check waits for this: it ends a conversation in which the client does nothing more.
GUARD_S = 30.0
ERRORS = SCHEMA.all["enums"]["ErrorCode"]["values"]


class Failed(Exception):
    """The client did not do what the check under way asks for."""


def require(holds, problem):
    if not holds:
        raise Failed(problem)


def fnv1a(data):
    """64-bit FNV-1a, as TOPOLOGY's hash; 16 hex digits."""
    value = 0xcbf29ce484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001b3 & 0xffffffffffffffff
    return f"{value:016x}"


def mesh_of(positions):
    """Of points [[x, y, z], …], as a client prints it."""
    return fnv1a(b"".join(struct.pack("<3f", *point) for point in positions))


class Verdicts:
    def __init__(self):
        self.lines = []  # (passed, name, sentence, what went wrong)
        self.name, self.sentence = "", ""

    def begin(self, name, sentence):
        """A check. It has passed when the next begins, or when its conversation ends."""
        if re.sub(r"\s+", " ", sentence) not in DOCUMENT:
            sys.exit(f"conformance: net/PROTOCOL.md does not say: {sentence}")
        self.end()
        self.name, self.sentence = name, sentence

    def end(self, problem=""):
        if self.name:
            self.lines.append((not problem, self.name, self.sentence, problem))
        self.name = ""

    def hold(self, conversation, *arguments):
        """Runs one conversation; what it began and did not reach fails."""
        try:
            conversation(self, *arguments)
            self.end()
        except Failed as failed:
            self.end(str(failed) or "not so")

    def are_good(self):
        return bool(self.lines) and all(passed for passed, *_ in self.lines)

    def show(self):
        for passed, name, sentence, problem in self.lines:
            print(f"{'passed' if passed else 'FAILED'}  {name}: {sentence}")
            if problem:
                print(f"        {problem}")
        print(f"{sum(passed for passed, *_ in self.lines)} of {len(self.lines)} checks passed")


class Client:
    """The client under test, one process; `lines` has what it printed so far."""

    def __init__(self, command, port, role, token=None):
        line = [*command, "127.0.0.1", str(port), role] + ([token] if token else [])
        self.process = subprocess.Popen(line, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.lines, self.arriving = [], queue.Queue()
        self.readers = [threading.Thread(target=self.read, daemon=True),
                        threading.Thread(target=self.read_errors, daemon=True)]
        self.errors = b""
        for reader in self.readers:
            reader.start()

    def __enter__(self):
        return self

    def __exit__(self, *ignored):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for reader in self.readers:
            reader.join()
        self.process.stdout.close()
        self.process.stderr.close()

    def read(self):
        for line in self.process.stdout:
            self.arriving.put(line)
        self.arriving.put(None)

    def read_errors(self):
        self.errors = self.process.stderr.read()

    def take(self, seconds):
        """The next line that is printed; None where none comes in that time. Failed at the end of the output."""
        try:
            line = self.arriving.get(timeout=seconds) if seconds > 0 else self.arriving.get_nowait()
        except queue.Empty:
            return None
        if line is None:
            self.arriving.put(None)
            self.readers[1].join()
            said = self.errors.decode("utf-8", "replace").strip()
            raise Failed("the client ended" + (f": {said[-300:]}" if said else ""))
        try:
            value = json.loads(line)
            (key, content), = value.items()
        except (ValueError, AttributeError) as error:
            raise Failed(f"the client printed what is no JSON object of one key: {line[:200]}") from error
        self.lines.append((key, content))
        return key, content

    def wait(self, key, is_it=lambda content: True):
        """The first line of that key, printed already or yet to come, of which is_it holds."""
        seen, end = 0, time.monotonic() + GUARD_S
        while True:
            for name, content in self.lines[seen:]:
                if name == key and is_it(content):
                    return content
            seen = len(self.lines)
            if self.take(max(0.01, end - time.monotonic())) is None:
                last = self.lines[-1] if self.lines else "nothing"
                raise Failed(f"the client did not print the {key} expected; last: {last}")

    def finish(self):
        """The line `closed`, and an exit with 0."""
        self.wait("closed")
        try:
            code = self.process.wait(timeout=GUARD_S)
        except subprocess.TimeoutExpired as error:
            raise Failed("the client printed `closed` and did not end") from error
        if code != 0:
            raise Failed(f"the client ended with {code}")


class Peer:
    """The judge's end of one connection, of a server or, in live conversations, of a client."""

    def __init__(self, connection):
        self.socket = connection
        self.socket.settimeout(GUARD_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.sent, self.received, self.data = 0, 0, b""
        self.stamp = 1 << 40  # of what the judge sends: any clock will do
        self.seen = []  # (name, header, body, sections)

    def close(self):
        self.socket.close()

    # --- out ---

    def bytes_of(self, name, body, sections=None):
        self.sent += 1
        self.stamp += 1_000_000
        return SCHEMA.encode(name, body, sections, self.sent, self.stamp)

    def example(self, name):
        """A golden message of the document: only sequence and stamp are this connection's."""
        of = SCHEMA.all["examples"][name]
        return self.bytes_of(of["message"], of["body"], of.get("sections"))

    def raw(self, kind, body, flags=0, version=1, magic=b"BRCY", length=None, skipped=0):
        """A message of any numbers."""
        self.sent += 1 + skipped
        self.stamp += 1_000_000
        size = len(body) if length is None else length
        return HEADER.pack(magic, version, kind, flags, size, self.sent, self.stamp) + body

    def put(self, data):
        try:
            self.socket.sendall(data)
        except OSError as error:
            raise Failed(f"the client closed the connection: {error}") from error

    def send(self, name, body, sections=None):
        self.put(self.bytes_of(name, body, sections))

    def send_state_request(self):
        self.put(self.raw(SCHEMA.types["STATE"], b""))

    # --- in ---

    def take(self):
        """The next message, checked against the rules for every message; None: the client ended its side."""
        while len(self.data) < 32 or len(self.data) < 32 + HEADER.unpack(self.data[:32])[4]:
            try:
                more = self.socket.recv(1 << 18)
            except TimeoutError as error:
                raise Failed("the peer sends nothing") from error
            except ConnectionResetError:
                return None
            if not more:
                return None
            self.data += more
        magic, version, kind, flags, length, sequence, stamp = HEADER.unpack(self.data[:32])
        message, self.data = self.data[:32 + length], self.data[32 + length:]
        self.received += 1
        if (magic, version, flags) != (b"BRCY", 1, 0):
            raise Failed(f"a header with {magic!r}, version {version}, flags {flags}")
        if sequence != self.received:
            raise Failed(f"message {self.received} has the sequence {sequence}")
        if stamp > (1 << 63) - 1:
            raise Failed(f"a stamp of {stamp}")
        name = SCHEMA.names.get(kind, str(kind))
        if name == "STATE" and length == 0:  # a request
            body, sections = {}, {}
        else:
            try:
                _, body, sections = SCHEMA.decode(message)
            except Exception as error:  # pylint: disable=broad-except
                raise Failed(f"a {name} cannot be read: {error}") from error
        entry = (name, {"sequence": sequence, "stamp_ns": stamp}, body, sections)
        self.seen.append(entry)
        if name == "PING" and body["reply"] == 0:
            now = self.stamp + 1
            self.send("PING", {"nonce": body["nonce"], "reply": 1, "echoed_stamp_ns": stamp, "received_ns": now})
        return entry

    def wait(self, name, is_it=lambda entry: True):
        """The next message of that name of which is_it holds; what comes between is read and kept."""
        end = time.monotonic() + GUARD_S
        while time.monotonic() < end:
            entry = self.take()
            if entry is None:
                raise Failed(f"the connection was closed before a {name} came")
            if entry[0] == name and is_it(entry):
                return entry
        raise Failed(f"no {name} came")

    def wait_for_end(self):
        """Until the client ends the connection."""
        end = time.monotonic() + GUARD_S
        while self.take() is not None:
            if time.monotonic() > end:
                raise Failed("the client keeps the connection")


class Listener:
    """A port of the loopback for one client."""

    def __enter__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(GUARD_S)
        self.port = self.socket.getsockname()[1]
        self.peer = None
        return self

    def accept(self):
        try:
            self.peer = Peer(self.socket.accept()[0])
        except TimeoutError as error:
            raise Failed("the client does not connect") from error
        return self.peer

    def __exit__(self, *ignored):
        self.socket.close()
        if self.peer:
            self.peer.close()
