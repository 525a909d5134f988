"""The programs that the cases of scripts/campaigns/faults.sh run and harm, and a row of what they measure."""
import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import time
import urllib.request

IS_SANITIZED = "BRACHY_SANITIZED" in os.environ  # then findings count, and figures do not
BIN = "build/asan/bin/" if IS_SANITIZED else "build/release/bin/"
SCENE, INSERTION = "config/prostate.toml", "config/insertion.csv"
WITNESSES = 20  # good viewers
MB = 1 << 20


class Row:
    def __init__(self, case, figure, limit, is_good):
        self.case, self.figure, self.limit, self.is_good = case, figure, limit, bool(is_good)


# --- processes ---


def start(arguments, folder, name, **more):
    out, err = open(f"{folder}/{name}.out", "w"), open(f"{folder}/{name}.err", "w")
    return subprocess.Popen(arguments, stdin=subprocess.DEVNULL, stdout=out, stderr=err, **more)


def read(path):
    with open(path, errors="replace") as file:
        return file.read()


def wait_for(what, condition, seconds=20.0, period=0.005):
    """Until condition() is true: its value, and the time."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value, time.monotonic()
        if time.monotonic() > end:
            raise RuntimeError(f"{what}: not within {seconds} s")
        time.sleep(period)


def findings(folder):
    """Lines of the programs' logs below a folder in which AddressSanitizer or UBSan reports."""
    found = []
    for path, _, names in os.walk(folder):
        for name in (n for n in names if n.endswith(".err")):
            reports = r".*(?:ERROR: \w*Sanitizer|runtime error:|SUMMARY: \w*Sanitizer).*"
            found += re.findall(reports, read(f"{path}/{name}"))
    return found


class Listening:
    """A program that listens, by its `pid`."""

    def memory_kb(self, key):
        return int(re.search(rf"^{key}:\s+(\d+)", read(f"/proc/{self.pid}/status"), re.M)[1])


class Daemon(Listening):
    """brachyd."""

    def __init__(self, folder, *options, scene=SCENE, port=0, before=(), name="brachyd"):
        self.log = f"{folder}/{name}.err"
        self.process = start(
            [*before, BIN + "brachyd", "--config", scene, "--port", str(port), *options], folder, name
        )
        lines, _ = wait_for("brachyd", lambda: self.ended() or self.ports(f"{folder}/{name}.out", options))
        if lines is True:
            raise RuntimeError("brachyd ended: " + read(self.log))
        self.port, self.http_port, self.igtl_port = (lines.get(k) for k in ("brachyd listening", "http", "igtl"))
        self.address = f"127.0.0.1:{self.port}"
        self.pid = self.process.pid

    def ended(self):
        return self.process.poll() is not None

    @staticmethod
    def ports(out, options):
        found = dict(re.findall(r"^(brachyd listening|http|igtl)s? on .*:(\d+)$", read(out), re.M))
        wanted = 1 + ("--http-port" in options) + ("--igtl-port" in options)
        return {k: int(v) for k, v in found.items()} if len(found) == wanted else None

    def says(self, pattern, seconds=20.0):
        """The match of a log line, and when it came."""
        return wait_for(f"the log line '{pattern}'", lambda: re.search(pattern, read(self.log)), seconds)

    def end(self, number=signal.SIGTERM):
        """Exit code and seconds after the signal."""
        begin = time.monotonic()
        self.process.send_signal(number)
        code = self.process.wait(30)
        return code, time.monotonic() - begin

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.pid}/fd"))


def metric(daemon, name):
    """A number of /metrics."""
    with urllib.request.urlopen(f"http://127.0.0.1:{daemon.http_port}/metrics", timeout=10) as answer:
        return float(re.search(rf"(?m)^{name} (\S+)$", answer.read().decode())[1])


class Relay(Listening):
    """brachy relay, of what a daemon publishes to `nats`."""

    def __init__(self, folder, nats):
        self.process = start([BIN + "brachy", "relay", "--nats", nats, "--port", "0"], folder, "relay")
        found, _ = wait_for(
            "the relay", lambda: re.search(r"(?m)^brachy relay listening on .*:(\d+)$", read(f"{folder}/relay.out"))
        )
        self.port, self.pid = int(found[1]), self.process.pid
        self.address = f"127.0.0.1:{self.port}"


@contextlib.contextmanager
def broker(folder):
    """The URL of a NATS server; None where there is none."""
    nats = shutil.which("nats-server", path=os.environ["PATH"] + ":/usr/sbin")
    if not nats:
        yield None
        return
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with running(start([nats, "-a", "127.0.0.1", "-p", str(port)], folder, "nats")):
        yield f"nats://127.0.0.1:{port}"


@contextlib.contextmanager
def running(process):
    """Ends what still runs when the block is left."""
    of = process.process if isinstance(process, (Daemon, Relay)) else process
    try:
        yield process
    finally:
        if of.poll() is None:
            of.send_signal(signal.SIGCONT)
            of.kill()
            of.wait()


class Crowd:
    """brachy_crowd: good viewers that measure, and bad peers."""

    number = 0

    def __init__(self, folder, daemon, *options, viewers=WITNESSES, seconds=10.0):
        Crowd.number += 1
        self.out = f"{folder}/crowd{Crowd.number}.out"
        self.process = start(
            [
                BIN + "brachy_crowd",
                "--port",
                str(daemon.port),
                "--viewers",
                str(viewers),
                "--seconds",
                str(seconds),
                *options,
            ],
            folder,
            f"crowd{Crowd.number}",
        )
        self.folder = folder

    def ready(self, seconds=30.0):
        wait_for("the crowd", lambda: "ready" in read(self.out), seconds)
        return self

    def result(self, seconds=120.0):
        self.process.wait(seconds)
        lines = read(self.out).splitlines()
        if self.process.returncode != 0 or not lines:
            raise RuntimeError("brachy_crowd: " + read(self.out.replace(".out", ".err")))
        return json.loads(lines[-1])

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        return self.result()


def recorder(daemon, folder):
    return start(
        [BIN + "brachy", "record", "--connect", daemon.address, "--out", f"{folder}/r.brachy"], folder, "record"
    )


def player(daemon, folder, trajectory, *options):
    return start([BIN + "brachy", "replay", trajectory, "--connect", daemon.address, *options], folder, "replay")


def measure(folder, daemon, *options, **more):
    with contextlib.ExitStack() as stack:
        crowd = Crowd(folder, daemon, *options, **more)
        stack.enter_context(running(crowd.process))
        return crowd.ready().result()


def missed_percent(crowd):
    return 100.0 * crowd["overruns"] / max(1, crowd["ticks"] + crowd["overruns"])


def gap_row(case, crowd, alone):
    gap, limit = crowd["gap_ms"]["p99"], max(66.0, 1.5 * alone["gap_ms"]["p99"])
    good = gap <= limit and crowd["served"] == WITNESSES
    return Row(
        case,
        f"{crowd['served']} good viewers' frame gap p50 {crowd['gap_ms']['p50']:.1f}, p99 {gap:.1f}, "
        f"max {crowd['gap_ms']['max']:.1f} ms",
        f"p99 {limit:.0f} ms",
        good,
    )


def scene_with(folder, **server):
    """The default scene with keys of [server] added or replaced."""
    lines, text = [], read(SCENE)
    text = re.sub(r'trajectory = "(?!/)([^"]+)"', rf'trajectory = "{os.getcwd()}/config/\1"', text)
    for line in text.splitlines():
        key = line.split("=")[0].strip()
        if key in server:
            line = f"{key} = {server.pop(key)}"
        lines.append(line)
    at = lines.index("[server]") + 1
    lines[at:at] = [f"{key} = {value}" for key, value in server.items()]
    path = f"{folder}/scene.toml"
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")
    return path


def log_seconds(stamp):
    """Of the day: brachyd's log lines begin with HH:MM:SS.mmm."""
    hours, minutes, seconds = stamp.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds)
