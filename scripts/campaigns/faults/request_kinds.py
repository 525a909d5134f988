"""The case "requests" of scripts/campaigns/faults.sh: well-formed requests of every kind and size over every door, by
six attackers at once, beside an operator, a viewer and a device with its needle in the tissue."""
import collections
import contextlib
import multiprocessing
import os
import random
import re
import socket
import struct
import threading
import time
import urllib.request

from attack import DEVICE, NO_MESH, OPERATOR, VIEWER, Client, attackers, connected, message, p99_ms
from attack import prefer_rightful_clients, split_messages
from programs import Daemon, Row, metric, read, running

HELLO, POSE, PING, ARM, DROP, CONTROL, IMAGE, SCANNER, LOAD, PLAN, CONTOUR = 1, 5, 9, 12, 13, 15, 17, 18, 19, 20, 21
EXERCISE = 22
KINDS = ["HELLO", "POSE", "PING", "ARM", "DROP", "CONTROL", "SCANNER", "LOAD", "PLAN", "CONTOUR", "EXERCISE", "unknown"]
DOORS = KINDS + ["HTTP", "OpenIGTLink"]
IMAGES, PLANS = 32, 64  # bits of a subscription
PAGES = ["/healthz", "/metrics", "/exercises", "/exercise-result", "/exercise-report", "/volume", "/",
         "/ws", "/index.html", "/nowhere"]
MOST_BODY, MOST_OUTLINES, MOST_POINTS = 65536, 64, 2000
IMAGE_TICK, IMAGE_PLANE = 16, 48  # offsets
LEAST_WAIT_S = 0.005  # for an answer, of a native peer
WATCHDOG_S = 2.0
SCENE = """name = "requests"
[plan]
file = "{root}/config/plan.toml"
[seeds]
applicator = "train"
[needle]
count = 2
[probe]
on = true
[server]
port = 0
http_port = 0
igtl_port = 0
igtl_commands = true
[realtime]
control_thread = true
"""


def text_field(text):
    data = text.encode()
    return struct.pack("<H", len(data)) + data


class Generator:
    """Requests of a seed. Most of each kind are valid; sizes are even in their logarithm, up to the limit."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.frozen = None  # tick and X_WI of the last image, as bytes
        self.change = 0  # of the plan in use

    def size(self, most):
        return min(most, int(most ** self.random.random()))

    def number(self):
        return self.random.choice([0, 1, -1, 1e-300, 1e300, float("nan"), float("inf"), self.random.uniform(-200, 200)])

    def name(self, most):
        return "".join(self.random.choice("abcXYZ019 ./\\%\n\u00e4") for _ in range(self.size(most)))[: most // 2]

    def hole(self):
        return self.random.choice("ABCDEFGHIJKLM") + str(self.random.randint(1, 13))

    def plan(self):
        most = self.random.choice([1, 5, 20, 169, 170, 500, 4096])
        body = b""
        count = 0
        for _ in range(self.random.randint(0, most)):
            depth = self.random.choice([float("nan"), self.random.uniform(40, 110), self.number()])
            train = self.random.choice(["", "s", "s-s-s", "".join(self.random.choice("s-") for _ in range(40)), "x"])
            hole = self.hole() if self.random.random() < 0.95 else self.name(200)
            needle = struct.pack("<HHId", count, 0, 0, depth) + text_field(hole) + text_field(train)
            if 36 + len(body) + len(needle) > MOST_BODY:
                break
            body += needle
            count += 1
        kind = self.random.choices([1, 2, 3, 7], [1, 2, 20, 1])[0]
        change = self.change if self.random.random() < 0.9 else self.random.randint(0, 5)
        head = struct.pack("<HHId", kind, 0, change, 0.5) + text_field("") + struct.pack("<HH", count, 0)
        return head + body + struct.pack("<HH", 0, 0)

    def contour(self):
        outlines = self.size(MOST_OUTLINES)
        body = b""
        tick, plane = self.frozen or (1, struct.pack("<12d", 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0))
        for k in range(outlines):
            count = max(3, self.size(MOST_POINTS))
            if self.random.random() < 0.5:  # an ellipse; else points anywhere, crossing
                points = [(40 + 15 * c, 30 + 10 * s) for c, s in circle(count)]
            else:
                points = [(self.random.uniform(0, 80), self.random.uniform(0, 60)) for _ in range(count)]
            body += struct.pack("<iIQd", k, count, tick, float("nan")) + plane
            body += struct.pack(f"<{2 * count}d", *(x for point in points for x in point))
        return struct.pack("<QHH", 0, outlines, 0) + body + struct.pack("<HH", 0, 0)

    def control(self):
        kernel = self.random.choice(["", "elastic", "psi31", "psi42", "gaussian", "tps", self.name(60000)])
        action = self.random.choices([0, 1, 2, 3, 4, 9], [1, 5, 5, 1, 5, 1])[0]
        radius = self.random.choice([float("nan"), 20.0, 60.0, self.number()])
        return struct.pack("<HHId", action, self.random.randint(0, 1), 0, radius) + text_field(kernel) + bytes(4)

    def scanner(self):
        array, freeze = self.random.randint(0, 5), self.random.randint(0, 3)
        numbers = [self.random.choice([float("nan"), self.number(), self.random.uniform(10, 100)]) for _ in range(7)]
        return struct.pack("<HHIQ7dHH", array, freeze, self.random.randint(0, 4), 0, *numbers, 0, 0)

    def native(self):
        """Name, number and body of a request."""
        r = self.random
        kind = r.choices(KINDS, [1, 4, 4, 6, 6, 10, 10, 10, 30, 8, 4, 4])[0]
        needle = r.choice([0, 1, 2, 7, 0xFFFF])
        if kind == "HELLO":
            return kind, HELLO, hello_body(r.randint(0, 5), self.name(80))
        if kind == "POSE":
            return kind, POSE, struct.pack("<HHI12d", needle, 0, 0, *(self.number() for _ in range(12)))
        if kind == "PING":
            return kind, PING, struct.pack("<QB7xQQ", r.getrandbits(64), r.randint(0, 2), r.getrandbits(63), 0)
        if kind == "ARM":
            return kind, ARM, struct.pack("<H6x", needle)
        if kind == "DROP":
            return kind, DROP, struct.pack("<HB5x", needle, r.randint(0, 2))
        if kind == "LOAD":
            return kind, LOAD, struct.pack("<HHI", needle, r.choice([r.randint(0, 30), 0xFFFF, r.randint(0, 65535)]), 0)
        if kind == "unknown":
            return kind, r.choice([0, 2, 3, 6, 23, 999, 65535]), bytes(self.size(MOST_BODY))
        return {
            "CONTROL": lambda: (kind, CONTROL, self.control()),
            "SCANNER": lambda: (kind, SCANNER, self.scanner()),
            "PLAN": lambda: (kind, PLAN, self.plan()),
            "CONTOUR": lambda: (kind, CONTOUR, self.contour()),
            "EXERCISE": lambda: (kind, EXERCISE, text_field(self.name(600)) + text_field(self.name(80)) + bytes(4)),
        }[kind]()

    def http(self):
        target = self.random.choice(PAGES)
        if self.random.random() < 0.2:
            target += "?" + "a" * self.size(8000)
        headers = "".join(f"X-{i}: {'b' * self.size(2000)}\r\n" for i in range(self.size(40)))
        method = self.random.choices(["GET", "HEAD", "POST", "OPTIONS"], [10, 3, 1, 1])[0]
        return f"{method} {target} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{headers}\r\n".encode()

    def openigtlink(self):
        r = self.random
        kind = r.choice(["TRANSFORM", "STRING", "GET_TRANS", "GET_IMAGE", "GET_POLYDATA", "GET_POINT", "GET_CAPABIL",
                         "STT_IMAGE", "STP_IMAGE", "STT_TDATA", "STP_TDATA", "STATUS", "IMAGE", "POINT"])
        body, name = b"", r.choice(["", "Needle2ToRas", "Prostate", "UltrasoundTransverse", "ProbeToRas", "Seeds"])
        if kind == "TRANSFORM":
            body = struct.pack(">12f", 1, 0, 0, 0, 1, 0, 0, 0, 1, *(r.uniform(-50, 50) for _ in range(3)))
        elif kind == "STRING":
            words = r.choice(["reset", "play", "stop", "model elastic", "model psi31 60", "arm 1", "drop 0", "drop 9"])
            text = (words if r.random() < 0.9 else self.name(60000)).encode()
            body = struct.pack(">HH", 3, len(text)) + text
        elif kind == "STT_TDATA":
            body = struct.pack(">i32s", r.randint(0, 100), b"RAS")
        elif kind in ("STATUS", "IMAGE", "POINT"):
            body = bytes(self.size(1 << 18))
        return struct.pack(">H12s20sQQQ", 1, kind.encode(), name.encode(), 0, len(body), 0) + body


def circle(count):
    step = complex(0.0, 6.283185307179586 / count)
    turned, turn = 1 + 0j, 2.718281828459045**step
    for _ in range(count):
        yield turned.real, turned.imag
        turned *= turn


def hello_body(role, name):
    nan = float("nan")
    return struct.pack("<HHIdddd", role, 0, NO_MESH | IMAGES | PLANS, nan, nan, nan, nan) + text_field(name) + bytes(4)


# --- attackers ---


class NativePeer:
    """An operator who sends whatever the generator says, reads what comes, and comes again when it was closed."""

    def __init__(self, port, generator, address):
        self.port, self.generator, self.address = port, generator, address
        self.peer = None

    def open(self):
        self.peer = connected(self.port, self.address)
        self.peer.sendall(message(HELLO, hello_body(OPERATOR, "asks")))
        self.peer.settimeout(LEAST_WAIT_S)
        self.sequence, self.left = 1, b""

    def send(self):
        if self.peer is None:
            self.open()
        kind, number, body = self.generator.native()
        self.sequence += 1
        self.peer.settimeout(2)
        self.peer.sendall(message(number, body, self.sequence))
        self.peer.settimeout(LEAST_WAIT_S)
        return kind

    def read(self):
        if self.peer is None:
            return
        while True:
            try:
                data = self.peer.recv(1 << 18)
            except TimeoutError:
                return
            if not data:
                self.close()
                return
            found, self.left = split_messages(self.left + data)
            for kind, body in found:
                if kind == PLAN:
                    self.generator.change = struct.unpack_from("<4xI", body)[0]
                if kind == IMAGE:
                    self.generator.frozen = image_plane(body)

    def close(self):
        if self.peer:
            self.peer.close()
        self.peer = None


class HttpPeer:
    """Asks for one page after the other, each over a connection of its own."""

    def __init__(self, port, generator, address):
        self.port, self.generator, self.address = port, generator, address

    def send(self):
        peer = connected(self.port, self.address)
        with contextlib.closing(peer):
            peer.settimeout(0.5)
            peer.sendall(self.generator.http())
            with contextlib.suppress(OSError):
                while peer.recv(1 << 18):
                    pass
        return "HTTP"

    def read(self):
        pass

    def close(self):
        pass


class IgtlPeer:
    """Sends OpenIGTLink's messages with commands, and reads what comes."""

    def __init__(self, port, generator, address):
        self.port, self.generator, self.address = port, generator, address
        self.peer = None

    def send(self):
        if self.peer is None:
            self.peer = connected(self.port, self.address)
        self.peer.settimeout(2)
        self.peer.sendall(self.generator.openigtlink())
        return "OpenIGTLink"

    def read(self):
        if self.peer is None:
            return
        self.peer.settimeout(LEAST_WAIT_S)
        with contextlib.suppress(TimeoutError):
            while True:
                if not self.peer.recv(1 << 18):
                    self.close()
                    return

    def close(self):
        if self.peer:
            self.peer.close()
        self.peer = None


def image_plane(body):
    """Tick and X_WI of an IMAGE (net/PROTOCOL.md)."""
    return struct.unpack_from("<Q", body, IMAGE_TICK)[0], body[IMAGE_PLANE : IMAGE_PLANE + 96]


def asks(peer_class, port, number, seed, per_s, counts):
    """Requests until the process is ended. What the server refuses or closes is no reason to stop."""
    peer = peer_class(port, Generator(seed), f"127.0.0.{number + 2}")
    due = time.monotonic()
    while True:
        due = max(due + 1.0 / per_s, time.monotonic() - 1.0)
        try:
            kind = peer.send()
            with counts.get_lock():
                counts[DOORS.index(kind)] += 1
            peer.read()
        except OSError:
            peer.close()
        time.sleep(max(0.0, due - time.monotonic()))


# --- those beside them ---


class ControlThread(threading.Thread):
    """Wakes as often as FORCE comes: what the machine alone adds to a gap."""

    def __init__(self):
        super().__init__(daemon=True)
        self.gaps, self.stop = [], threading.Event()
        self.start()

    def run(self):
        last = due = time.monotonic()
        while not self.stop.is_set():
            due += 0.005
            time.sleep(max(0.0, due - time.monotonic()))
            now = time.monotonic()
            self.gaps.append(now - last)
            last = now


def exchanges(task, longest_ns, above, is_over):
    """As much processor time as another thread takes, in turns that send a byte to itself and take it: what the kernel
    adds to a turn. It works on what others have sent where it is called next, in whoever's time that is, for up to
    net.core.netdev_budget_usecs."""
    ticks_per_s = os.sysconf("SC_CLK_TCK")
    with socket.create_server(("127.0.0.1", 0)) as server:
        here = socket.create_connection(server.getsockname())
        there, _ = server.accept()
    while not is_over.is_set():
        fields = read(f"/proc/{task}/stat").rpartition(")")[2].split()
        theirs_s = (int(fields[11]) + int(fields[12])) / ticks_per_s
        for _ in range(20):
            if time.process_time() >= theirs_s:
                time.sleep(0.002)
                break
            begin = time.thread_time_ns()
            here.send(b"x")
            there.recv(1)
            took = time.thread_time_ns() - begin
            longest_ns.value = max(longest_ns.value, took)
            above.value += took > 1e6


@contextlib.contextmanager
def exchanging(task):
    """What `exchanges` finds meanwhile: the longest turn, ns, and how many take more than 1 ms."""
    longest_ns, above, is_over = multiprocessing.Value("q"), multiprocessing.Value("q"), multiprocessing.Event()
    process = multiprocessing.Process(target=exchanges, args=(task, longest_ns, above, is_over), daemon=True)
    process.start()
    yield longest_ns, above
    is_over.set()
    process.join()


class Watchdog(threading.Thread):
    """A service manager's end of sd_notify: the times at which the daemon said that it lives."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(path)
        self.times = []
        self.start()

    def run(self):
        with contextlib.suppress(OSError):
            while True:
                if b"WATCHDOG=1" in self.socket.recv(4096):
                    self.times.append(time.monotonic())

    def longest_s(self):
        return max((b - a for a, b in zip(self.times, self.times[1:])), default=float("inf"))


def turns_above_ms(daemon, ms):
    """Handlers of the io thread that took more processor time, by /metrics' histogram."""
    with urllib.request.urlopen(f"http://127.0.0.1:{daemon.http_port}/metrics", timeout=10) as answer:
        text = answer.read().decode()
    found = re.findall(r'(?m)^brachy_io_turn_seconds_bucket\{le="([^"]+)"\} (\S+)$', text)
    buckets = {float(le): float(n) for le, n in found}
    return buckets[float("inf")] - max(n for le, n in buckets.items() if le <= 1e-3 * ms * (1 + 1e-9))


@contextlib.contextmanager
def attacked(folder, name, per_s, seed):
    """A daemon and its six attackers, which wait for the event."""
    os.makedirs(f"{folder}/{name}")
    scene = f"{folder}/{name}/scene.toml"
    with open(scene, "w") as file:
        file.write(SCENE.format(root=os.getcwd()))
    watchdog = Watchdog(f"{folder}/{name}/notify")
    before = ("env", f"NOTIFY_SOCKET={folder}/{name}/notify", f"WATCHDOG_USEC={int(1e6 * WATCHDOG_S)}")
    options = ("--http-port", "0", "--igtl-port", "0", "--session", f"{folder}/{name}/session")
    counts = multiprocessing.Array("q", len(DOORS))
    with contextlib.ExitStack() as stack:
        daemon = stack.enter_context(running(Daemon(f"{folder}/{name}", *options, scene=scene, before=before)))
        classes = [(NativePeer, daemon.port)] * 4 + [(HttpPeer, daemon.http_port), (IgtlPeer, daemon.igtl_port)]
        begins = stack.enter_context(
            attackers(
                *[
                    (asks, kind, int(port), i, 1000 * seed + i, per_s / 6, counts)
                    for i, (kind, port) in enumerate(classes)
                ]
            )
        )
        yield daemon, begins, counts, watchdog


def requests(folder, short):
    """100,000 requests of every kind and size by six peers at once; SIGTERM in the middle of them."""
    count, per_s = (3000, 300) if short else (100_000, 400)
    rows = []
    with (
        attacked(folder, "long", per_s, 1) as (daemon, begins, counts, watchdog),
        exchanging(f"{daemon.pid}/task/{daemon.pid}") as (longest_ns, slow_turns),
    ):
        clients = {role: Client(daemon.port, role, None) for role in (VIEWER, OPERATOR, DEVICE)}
        prefer_rightful_clients()
        for client in clients.values():
            if not client.welcomed.wait(5):
                raise RuntimeError(f"not welcomed: {client.closed}")
        device, stop = clients[DEVICE], threading.Event()
        threading.Thread(target=device.move, args=(stop,), daemon=True).start()
        time.sleep(4)
        quiet_turn_ms = 1e3 * metric(daemon, "brachy_io_turn_seconds_max")
        ticks, control = clients[OPERATOR].state, ControlThread()
        prefer_rightful_clients()
        device.gaps = []
        begins.set()
        end, half_kb = time.monotonic() + 4 * count / per_s, None
        while sum(counts) < count and time.monotonic() < end and not daemon.ended():
            time.sleep(1)
            if half_kb is None and sum(counts) >= count / 2:
                half_kb = daemon.memory_kb("VmRSS")
        gaps, sent = list(device.gaps), dict(zip(DOORS, counts))
        control.stop.set()
        later = clients[OPERATOR].state
        turn_ms = 1e3 * metric(daemon, "brachy_io_turn_seconds_max")
        above = turns_above_ms(daemon, 1)
        grown_mb = (daemon.memory_kb("VmRSS") - half_kb) / 1024
        stop.set()
        reasons = [client.closed for client in clients.values() if client.closed]
        for client in clients.values():
            client.end()
        code, seconds = daemon.end()
    told = ", ".join(f"{kind} {n}" for kind, n in sent.items())
    p99, machine, machine_ms = p99_ms(gaps), p99_ms(control.gaps), 1e-6 * longest_ns.value
    ran = later[0] - ticks[0] + later[1] - ticks[1]
    more = 100.0 * ((later[1] - ticks[1]) - (later[2] - ticks[2])) / max(1, ran)
    rows += [
        Row("requests: sent", f"{sum(sent.values())}: {told}", f"{count}", sum(sent.values()) >= count),
        Row("  operator, viewer, device", f"{3 - len(reasons)} of 3 stay {'; '.join(reasons)}", "3", not reasons),
        Row(
            "  longest turn of the io thread",
            f"{turn_ms:.2f} ms of processor time, {quiet_turn_ms:.2f} before; {above:.0f} over 1 ms; another's, "
            f"which sends itself bytes as long: {machine_ms:.2f} ms, {slow_turns.value} over 1 ms",
            "2 ms",
            turn_ms <= 2,
        ),
        Row(
            "  FORCE gap p99",
            f"{p99:.2f} ms of {len(gaps)}; a thread that only wakes: {machine:.2f}",
            f"{machine + 3:.2f} ms",
            p99 <= machine + 3,
        ),
        # Four operators who change models and plans all the time share the two cores: for the record.
        Row("  ticks missed", f"{more:+.2f} % against the control thread", "", True),
        Row("  watchdog", f"fed every {watchdog.longest_s():.2f} s at most", f"{WATCHDOG_S} s",
            watchdog.longest_s() <= WATCHDOG_S),
        Row("  memory", f"{grown_mb:+.0f} MB in the second half", "32 MB", grown_mb <= 32),
        Row("  SIGTERM after it", f"exit {code} after {seconds:.2f} s", "0 within 2 s", code == 0 and seconds <= 2),
    ]
    ends = collections.Counter()
    longest = 0.0
    moments = random.Random(2)
    for i in range(3 if short else 20):
        with attacked(folder, f"sigterm{i}", per_s, 100 + i) as (daemon, begins, _, _):
            begins.set()
            time.sleep(moments.uniform(0.2, 5.0))
            code, seconds = daemon.end()
            longest = max(longest, seconds)
            ends[code] += 1
            if code != 0:
                rows.append(Row("  its last words", read(daemon.log)[-300:], "", False))
    rows.append(
        Row(
            f"SIGTERM at {sum(ends.values())} moments of it",
            f"exit codes {dict(ends)}, after {longest:.2f} s at most",
            "0 within 2 s",
            set(ends) == {0} and longest <= 2,
        )
    )
    return rows
