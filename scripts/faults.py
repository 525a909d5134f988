"""The cases of scripts/faults.sh. Each starts its own daemon on a free port, harms it, and returns rows: what was measured,
its figure, its limit, and whether that was kept. Processes are ended by their id."""
import argparse
import base64
import contextlib
import json
import os
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

BIN = "build/release/bin/"
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


class Daemon:
    """brachyd, listening."""

    def __init__(self, folder, *options, scene=SCENE, port=0, before=(), name="brachyd"):
        self.log = f"{folder}/{name}.err"
        self.process = start([*before, BIN + "brachyd", "--config", scene, "--port", str(port), *options], folder, name)
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
        found = dict(re.findall(r"^(brachyd listening|http|igtl) on .*:(\d+)$", read(out), re.M))
        wanted = 1 + ("--http-port" in options) + ("--igtl-port" in options)
        return {k: int(v) for k, v in found.items()} if len(found) == wanted else None

    def says(self, pattern, seconds=20.0):
        """The match of a log line, and when it came."""
        return wait_for(f"the log line '{pattern}'", lambda: re.search(pattern, read(self.log)), seconds)

    def end(self):
        """Exit code and seconds after SIGTERM."""
        begin = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(30)
        return code, time.monotonic() - begin

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.pid}/fd"))

    def memory_kb(self, key):
        return int(re.search(rf"^{key}:\s+(\d+)", read(f"/proc/{self.pid}/status"), re.M)[1])


@contextlib.contextmanager
def running(process):
    """Ends what still runs when the block is left."""
    of = process.process if isinstance(process, Daemon) else process
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
        self.process = start([BIN + "brachy_crowd", "--port", str(daemon.port), "--viewers", str(viewers),
                              "--seconds", str(seconds), *options], folder, f"crowd{Crowd.number}")
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
    return Row(case, f"{crowd['served']} good viewers' frame gap p50 {crowd['gap_ms']['p50']:.1f}, p99 {gap:.1f}, "
               f"max {crowd['gap_ms']['max']:.1f} ms", f"p99 {limit:.0f} ms", good)


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


# --- cases ---

def sent_queue(daemon, process):
    """Bytes that the daemon's socket to a process still holds: of /proc/net/tcp, that of the process's port."""
    inodes = set()
    for fd in os.listdir(f"/proc/{process.pid}/fd"):
        with contextlib.suppress(OSError):
            inodes.add(os.readlink(f"/proc/{process.pid}/fd/{fd}"))
    rows = [line.split() for line in read("/proc/net/tcp").splitlines()[1:]]
    own = {row[1] for row in rows if f"socket:[{row[9]}]" in inodes}
    return {row[2]: int(row[4].split(":")[0], 16) for row in rows
            if row[2] in own and row[1].endswith(f":{daemon.port:04X}")}


def viewers(folder, short):
    """Good viewers beside slow and stopped peers."""
    seconds = 8 if short else 20
    rows = []
    with running(Daemon(folder, "--play", "--trajectory", INSERTION)) as daemon:
        alone = measure(folder, daemon, seconds=seconds)
        rows.append(Row("20 viewers alone", f"frame gap p50 {alone['gap_ms']['p50']:.1f}, p99 {alone['gap_ms']['p99']:.1f}, max "
                        f"{alone['gap_ms']['max']:.1f} ms", "", alone["served"] == WITNESSES))
        slow = measure(folder, daemon, "--bad", "slow", seconds=seconds)
        rows.append(gap_row("beside a reader at 1 kB/s", slow, alone))
        joined, _ = daemon.says(r"(\S+) .*'slow' from .* joined")
        left, _ = daemon.says(r"(\S+) .*'slow' from .* left: (.*)")
        after = log_seconds(left[1]) - log_seconds(joined[1])
        dropped = re.search(r"(\d+) snapshots dropped", left[2])
        is_closed = left[2].startswith("read nothing")
        rows.append(Row("  the slow reader", f"{'closed' if is_closed else 'kept for'} {after:.2f} s after it joined, "
                        f"{slow['bad'][0]['bytes_read']} bytes read; {dropped[1] if dropped else 0} snapshots dropped for it",
                        "kept, or closed within 5 s; drops counted", (after <= 5 or not is_closed) and dropped))
        watch = start([BIN + "brachy", "watch", "--connect", daemon.address], folder, "watch")
        with running(watch):
            crowd = Crowd(folder, daemon, seconds=max(seconds, 9))
            with running(crowd.process):
                crowd.ready()
                watch.send_signal(signal.SIGSTOP)
                stopped = taken = last_look = time.monotonic()
                queue, line = sent_queue(daemon, watch), None
                while not line:
                    now, new = time.monotonic(), sent_queue(daemon, watch)
                    if new != queue and new:
                        taken = last_look
                        queue = new
                    line = re.search(r"'brachy watch' from .* left: (.*)", read(daemon.log))
                    if now - stopped > 20:
                        raise RuntimeError("the stopped viewer is not closed")
                    last_look = now
                    time.sleep(0.004)
                closed = time.monotonic()
                stalled = crowd.result()
            watch.send_signal(signal.SIGCONT)
            code = watch.wait(10)
        rows.append(gap_row("beside a SIGSTOPped viewer", stalled, alone))
        dropped = re.search(r"(\d+) snapshots dropped", line[1])
        rows.append(Row("  the stopped viewer", f"closed {closed - taken:.2f} s after it took its last byte, {closed - stopped:.2f} s "
                        f"after SIGSTOP; {dropped[1] if dropped else 0} snapshots dropped; exit {code} with the reason after SIGCONT",
                        "5 s", closed - taken <= 5 and dropped and code == 1))
    with running(Daemon(folder, name="brachyd2")) as daemon:
        replay = player(daemon, folder, INSERTION, "--loop")
        with running(replay):
            daemon.says("'brachy replay' .* joined")
            alone = measure(folder, daemon, seconds=seconds)
            crowd = Crowd(folder, daemon, seconds=max(seconds, 7))
            with running(crowd.process):
                crowd.ready()
                replay.send_signal(signal.SIGSTOP)
                stopped = time.monotonic()
                _, closed = daemon.says("'brachy replay' .* left: ")
                stalled = crowd.result()
        rows.append(gap_row("beside a SIGSTOPped device", stalled, alone))
        rows.append(Row("  the stopped device", f"closed and its needle free {closed - stopped:.2f} s after SIGSTOP", "5 s",
                        closed - stopped <= 5))
    return rows


def limit(folder, short):
    """100 clients for 64 places."""
    seconds = 8 if short else 20
    scene = scene_with(folder, max_clients=64, max_clients_per_address=64)
    with running(Daemon(folder, "--play", "--trajectory", INSERTION, scene=scene)) as daemon:
        alone = measure(folder, daemon, "--surface", viewers=64, seconds=seconds)
        crowd = Crowd(folder, daemon, "--surface", viewers=64, seconds=seconds)
        busy, rounds = [], 0
        with running(crowd.process):
            crowd.ready()
            end = time.monotonic() + seconds - 1
            while time.monotonic() < end:
                late = measure(folder, daemon, "--surface", viewers=36, seconds=0.1)
                busy.append(late["busy"])
                rounds += 1
                time.sleep(0.3)
            full = crowd.result()
    more = missed_percent(full) - missed_percent(alone)
    return [Row("100 clients, 64 places", f"{full['served']} served, {min(busy)} of the others told BUSY ({rounds} times over)",
                "64 and 36", full["served"] == 64 and min(busy) == 36),
            Row("  ticks missed", f"{missed_percent(full):.2f} % against {missed_percent(alone):.2f} % without the 36", "+1 %", more <= 1)]


def half_open(folder, short):
    """Peers whose connection passes nothing any more."""
    seen = []
    with running(Daemon(folder, "--trajectory", INSERTION, "--igtl-port", "0")) as daemon:
        for _ in range(2 if short else 5):
            crowd = Crowd(folder, daemon, "--bad", "half-open-viewer", "half-open-device", viewers=1, seconds=7)
            with running(crowd.process):
                crowd.ready()
                count = len(seen) + 1
                left = "'half-open-[a-z]*' .* left: (?:said|read) nothing"
                at = [wait_for("half-open peers", lambda n=count + i: len(re.findall(left, read(daemon.log))) >= n)[1]
                      for i in range(2)]
                seen += [t - 1e-9 * bad["began_ns"] for t, bad in zip(at, crowd.result()["bad"])]
    return [Row("half-open viewers and devices", f"seen after {min(seen):.2f} to {max(seen):.2f} s", "5 s", max(seen) <= 5)]


def native_header(kind, length, sequence=1):
    return b"BRCY" + struct.pack("<HHIIQQ", 1, kind, 0, length, sequence, 0)


def lies(folder, short):
    """Lengths that lie, on every listener."""
    del short
    slowest, told = 0.0, 0
    with running(Daemon(folder, "--http-port", "0", "--igtl-port", "0")) as daemon:
        hello = struct.pack("<HHIddddH", 1, 0, 8, *[float("nan")] * 4, 3) + b"lie" + struct.pack("<HH", 0, 0)

        def lie(port, *parts):
            """From the lie, the last part, to the end of the stream."""
            nonlocal slowest, told
            with socket.create_connection(("127.0.0.1", port), 5) as peer:
                for part in parts[:-1]:
                    peer.sendall(part)
                    peer.recv(4096)
                peer.sendall(parts[-1])
                begin = time.monotonic()
                with contextlib.suppress(ConnectionError):
                    while peer.recv(65536):
                        pass
                slowest = max(slowest, time.monotonic() - begin)
                told += 1

        lie(daemon.port, native_header(1, 65537))  # what is needed once is there from here on
        before, held = daemon.memory_kb("VmPeak"), daemon.descriptors()
        for length in (65537, 1 << 20, 1 << 31, (1 << 32) - 1):
            lie(daemon.port, native_header(1, length))
            lie(daemon.port, native_header(1, len(hello)) + hello, native_header(9, length, 2))
        key = base64.b64encode(b"0123456789abcdef").decode()
        upgrade = (f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{daemon.http_port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                   f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n").encode()
        for length in (1 << 17, 1 << 32, (1 << 63) - 1, 1 << 63, (1 << 64) - 1):
            lie(daemon.http_port, upgrade, b"\x82\xff" + struct.pack(">Q", length) + b"mask" + b"x" * 100)
        for length in (1 << 32, (1 << 64) - 1):
            lie(daemon.http_port, (f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{daemon.http_port}\r\nContent-Length: {length}"
                                   "\r\n\r\n").encode())
        for length in ((1 << 30) + 1, 1 << 32, 1 << 63, (1 << 64) - 1):
            lie(daemon.igtl_port, struct.pack(">H12s20sQQQ", 1, b"TRANSFORM", b"NeedleToRas", 0, length, 0) + b"x" * 100)
        grown = daemon.memory_kb("VmPeak") - before
        wait_for("the descriptors", lambda: daemon.descriptors() <= held)
        code, _ = daemon.end()
    return [Row("lengths up to 2^64 - 1", f"{told} lies, each closed within {1e3 * slowest:.1f} ms", "100 ms", slowest <= 0.1),
            Row("  memory", f"address space at its peak {grown} kB above that after the first", "64 kB", grown <= 64 and code == 0)]


def flood(folder, short):
    """10,000 poses a second."""
    seconds = 4 if short else 10
    with running(Daemon(folder)) as daemon:
        alone = measure(folder, daemon, seconds=seconds)
        crowd = measure(folder, daemon, "--bad", "flood", seconds=seconds)
    bad = crowd["bad"][0]
    most = 200 + 2000 * (seconds + 1)
    told = bad["errors"] > 0 and bad["errors"] <= seconds + 3
    known = bad["poses_sent"] - crowd["poses_accepted"] - crowd["poses_refused"]
    return [Row("poses at 10 kHz", f"{bad['poses_sent']} sent, {crowd['poses_accepted']} accepted, {crowd['poses_refused']} refused and "
                f"counted, told {bad['errors']} times", "2000 a second", crowd["poses_accepted"] <= most
                and told and known < 10_000 and not bad["closed"]),
            gap_row("  beside it", crowd, alone)]


def stop(folder, short):
    """The server itself stopped for 2 s."""
    del short
    with running(Daemon(folder)) as daemon:
        replay = player(daemon, folder, INSERTION, "--loop")
        with running(replay):
            daemon.says("'brachy replay' .* joined")
            crowd = Crowd(folder, daemon, seconds=9)
            with running(crowd.process):
                crowd.ready()
                began = time.monotonic()
                time.sleep(1)
                daemon.process.send_signal(signal.SIGSTOP)
                time.sleep(2)
                daemon.process.send_signal(signal.SIGCONT)
                result = crowd.result()
                elapsed = time.monotonic() - began
            is_playing = replay.poll() is None
        code, _ = daemon.end()
    deadlines = result["ticks"] + result["overruns"]
    return [Row("SIGSTOP of the server for 2 s", f"{result['served']} of {WITNESSES} viewers and {int(is_playing)} of 1 devices came "
                f"through; exit {code}", "all", result["served"] == WITNESSES and is_playing and code == 0),
            Row("  deadlines", f"{result['overruns']} missed and counted; met and missed {deadlines} in {elapsed:.2f} s: none made up for",
                "200 a second", result["overruns"] >= 390 and deadlines <= 200 * elapsed + 20)]


def descriptors(folder, short):
    """No descriptors left."""
    del short
    with running(Daemon(folder, "--play", "--trajectory", INSERTION)) as daemon:
        alone = measure(folder, daemon, seconds=4)
        crowd = Crowd(folder, daemon, seconds=6)
        with running(crowd.process):
            crowd.ready()
            soft, hard = resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE)
            resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE, (daemon.descriptors(), hard))
            hello = struct.pack("<HHIddddH", 1, 0, 8, *[float("nan")] * 4, 4) + b"late" + struct.pack("<HH", 0, 0)
            late = [socket.create_connection(("127.0.0.1", daemon.port), 10) for _ in range(10)]
            for peer in late:
                peer.sendall(native_header(1, len(hello)) + hello)
            daemon.says("cannot accept a connection")
            time.sleep(2)
            resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE, (soft, hard))
            begin = time.monotonic()
            welcomed = sum(peer.recv(32)[6:8] == b"\x02\x00" for peer in late)
            waited = time.monotonic() - begin
            for peer in late:
                peer.close()
            result = crowd.result()
    return [Row("no descriptors for 2 s", f"{welcomed} of 10 who waited are welcomed {1e3 * waited:.0f} ms after there are some",
                "10, 500 ms", welcomed == 10 and waited <= 0.5),
            gap_row("  those who were there", result, alone)]


def recorder(daemon, folder):
    return start([BIN + "brachy", "record", "--connect", daemon.address, "--out", f"{folder}/r.brachy"], folder, "record")


def player(daemon, folder, trajectory, *options):
    return start([BIN + "brachy", "replay", trajectory, "--connect", daemon.address, *options], folder, "replay")


def inspected(recording):
    done = subprocess.run([BIN + "brachy", "inspect", recording, "--json"], capture_output=True, text=True, check=False)
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {"damage": done.stderr}


def whole_rows(path):
    """Rows of a CSV without its header; what is wrong with it raises."""
    text = read(path)
    if not text.endswith("\n"):
        raise RuntimeError(f"{path} ends within a row")
    rows = [line.split(",") for line in text.splitlines()]
    if any(len(row) != len(rows[0]) for row in rows):
        raise RuntimeError(f"{path} has a torn row")
    return rows[1:]


def session_rows(folder):
    poses, forces = whole_rows(f"{folder}/poses.csv"), whole_rows(f"{folder}/forces.csv")
    times = [float(row[0]) for row in poses]
    if any(b <= a for a, b in zip(times, times[1:])):
        raise RuntimeError("poses.csv: times do not increase")
    return poses, forces, whole_rows(f"{folder}/seeds.csv")


def disk(folder, short):
    """A disk that is full."""
    del short
    tried = subprocess.run(["unshare", "-rm", "sh", "-c", f"mount -t tmpfs -o size=1m tmpfs {folder}"], capture_output=True, check=False)
    if tried.returncode != 0:
        return [Row("full disk", "skipped: no file system may be mounted here: " + tried.stderr.decode().strip(), "", True)]

    def before(kept, size):
        os.makedirs(f"{folder}/disk", exist_ok=True)
        script = (f'mount -t tmpfs -o size={size} tmpfs {folder}/disk && {{ "$@"; code=$?; cp -r {folder}/disk {folder}/{kept}; '
                  'exit $code; }')
        return ["unshare", "-rm", "sh", "-c", script, "sh"]

    with running(Daemon(folder, "--play", "--trajectory", INSERTION, "--session", f"{folder}/disk/session", "--duration", "40",
                        before=before("kept", "128k"))) as daemon:
        crowd = Crowd(folder, daemon, viewers=1, seconds=60)
        with running(crowd.process):
            crowd.ready()
            daemon.says("session: .*No space left", 30)
            told = len(re.findall("error.*session: ", read(daemon.log)))
            code = daemon.process.wait(60)
            result = crowd.stop()
        poses, forces, _ = session_rows(f"{folder}/kept/session")
    rows = [Row("full disk under --session", f"said {told} time in the log, the daemon went on ({result['ticks']} ticks, exit {code}); "
                f"{len(poses)} poses and {len(forces)} forces are whole", "once, readable", told == 1 and code == 0 and len(poses) > 1000)]
    with running(Daemon(folder, "--play", "--trajectory", INSERTION, name="brachyd2")) as daemon:
        record = subprocess.run([*before("recorded", "1m"), BIN + "brachy", "record", "--connect", daemon.address, "--out",
                                 f"{folder}/disk/r.brachy"], capture_output=True, text=True, timeout=60, check=False)
        found = inspected(f"{folder}/recorded/r.brachy")
    rows.append(Row("full disk under `brachy record`", f"exit {record.returncode}: …{record.stderr.strip()[-90:]}; "
                    f"{os.path.getsize(folder + '/recorded/r.brachy')} bytes, damage: {found['damage']}", "exit 1, readable",
                    record.returncode == 1 and "No space left" in record.stderr and found["damage"] is None))
    return rows


def kill(folder, short):
    """kill -9 of the daemon and of the recorder during a session with seeds."""
    needles = f"{folder}/needles.csv"
    subprocess.run([BIN + "brachy", "plan", "--config", "config/session.toml", "--trajectory", needles], check=True,
                   stdout=subprocess.DEVNULL)
    rows = []
    for killed in ("daemon", "recorder"):
        work = f"{folder}/{killed}"
        os.makedirs(work)
        with running(Daemon(work, "--session", f"{work}/session", scene="config/session.toml")) as daemon, \
             running(recorder(daemon, work)) as record, \
             running(player(daemon, work, needles, "--speed", "2")):
            daemon.says("'brachy record' .* joined")
            witness = Crowd(work, daemon, "--surface", viewers=1, seconds=100)
            with running(witness.process):
                witness.ready()
                time.sleep(10 if short else 30)
                (daemon.process if killed == "daemon" else record).kill()
                seen = witness.stop()
            record.wait(10)
            found = inspected(f"{work}/r.brachy")
            lost, seeds = 0.005 * (seen["last_tick"] - found["last_tick"]), found["seeds"]
            rows.append(Row(f"kill -9 of the {killed}", f"the recording ends {lost:.3f} s before what a witness saw, with {seeds} of its "
                            f"{seen['seeds']} seeds; damage: {found['damage']}", "1 s", lost <= 1 and found["damage"] is None
                            and seeds >= seen["seeds"] - 1 and seen["seeds"] > 0))
            if killed == "recorder":
                daemon.end()
                continue
            poses, _, ledger = session_rows(f"{work}/session")
            behind = 0.005 * seen["last_tick"] - float(poses[-1][0])
            rows.append(Row("  session and ledger", f"poses end {behind:.3f} s before it; {len(ledger)} seeds are in the ledger, it saw "
                            f"{seen['seeds']}", "1 s, every seed", behind <= 1 and len(ledger) >= seen["seeds"]))
        if killed == "daemon":
            with running(Daemon(work, "--session", f"{work}/session", scene="config/session.toml", name="again")) as daemon:
                text, _ = daemon.says(r"(\d+) seeds of an earlier run")
                again = measure(work, daemon, "--surface", viewers=1, seconds=0.5)
                daemon.end()
            rows.append(Row("  the next daemon", f"goes on with {again['seeds']} seeds", f"{len(ledger)}",
                            again["seeds"] == len(ledger) == int(text[1])))
    return rows


def sigterm(folder, short):
    """SIGTERM under load."""
    times, bad = [], []
    count = 10 if short else 100
    for i in range(count):
        work = f"{folder}/{i}"
        os.makedirs(work)
        with running(Daemon(work, "--session", f"{work}/session", "--http-port", "0", "--igtl-port", "0")) as daemon, \
             running(player(daemon, work, INSERTION, "--loop")) as replay, running(recorder(daemon, work)) as record:
            crowd = Crowd(work, daemon, viewers=8, seconds=60)
            with running(crowd.process):
                crowd.ready()
                time.sleep(0.3 + 0.011 * i)
                code, seconds = daemon.end()
                times.append(seconds)
                crowd.stop()
            codes = (code, record.wait(10), replay.wait(10))
        try:
            poses, _, _ = session_rows(f"{work}/session")
            found = inspected(f"{work}/r.brachy")
            if codes != (0, 0, 0) or found["damage"] or found["frames"] < 2 or len(poses) < 20:
                raise RuntimeError(f"exit codes {codes}, damage {found['damage']}, {len(poses)} poses")
            shutil.rmtree(work)
        except (RuntimeError, OSError, KeyError) as error:
            bad.append(f"{work}: {error}")
    return [Row(f"SIGTERM under load, {count} times", f"exit 0 within {max(times):.2f} s, mean {sum(times) / count:.2f} s; recording "
                f"and session readable {count - len(bad)} times" + "".join("; " + b for b in bad[:2]), "2 s, each time",
                max(times) <= 2 and not bad)]


def start_stop(folder, short):
    """Start and stop on one port."""
    count = 10 if short else 100
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    slowest = slowest_start = 0.0
    good, before = 0, set(os.listdir("/dev/shm")) | set(os.listdir("/tmp"))
    for _ in range(count):
        begin = time.monotonic()
        with running(Daemon(folder, port=port)) as daemon:
            slowest_start = max(slowest_start, time.monotonic() - begin)
            with socket.create_connection(("127.0.0.1", port), 5):
                code, seconds = daemon.end()
        slowest = max(slowest, seconds)
        good += code == 0
    left = (set(os.listdir("/dev/shm")) | set(os.listdir("/tmp"))) - before
    left = {name for name in left if "brachy" in name and not folder.endswith(name)}
    return [Row(f"start and stop, {count} times", f"{good} times exit 0 on one port; up within {slowest_start:.2f} s, ended within "
                f"{slowest:.2f} s; {len(left)} files left", f"{count}, 2 s", good == count and slowest <= 2 and not left)]


CASES = {"viewers": viewers, "limit": limit, "half-open": half_open, "lies": lies, "flood": flood, "stop": stop, "descriptors": descriptors,
         "disk": disk, "kill": kill, "sigterm": sigterm, "start-stop": start_stop}


def main():
    parser = argparse.ArgumentParser(prog="scripts/faults.sh")
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--json")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=" ".join(CASES))
    options = parser.parse_args()
    unknown = [case for case in options.cases if case not in CASES]
    if unknown:
        parser.error(f"no case {unknown[0]}; there are {' '.join(CASES)}")
    work = tempfile.mkdtemp(prefix="faults_")
    rows = []
    for name in options.cases or CASES:
        folder = f"{work}/{name}"
        os.makedirs(folder)
        print(f"faults: {name}: {CASES[name].__doc__}", flush=True)
        try:
            rows += CASES[name](folder, options.short)
        except (RuntimeError, OSError, KeyError, subprocess.SubprocessError) as error:
            rows.append(Row(name, f"{type(error).__name__}: {error}", "", False))
        for row in rows:
            if not hasattr(row, "shown"):
                print(f"  {'ok    ' if row.is_good else 'MISSED'}  {row.case:<32} {row.figure}", flush=True)
                row.shown = True
    print("\n| case | figure | limit | verdict |\n|---|---|---|---|")
    for row in rows:
        print(f"| {row.case.strip()} | {row.figure} | {row.limit} | {'ok' if row.is_good else '**missed**'} |")
    if options.json:
        with open(options.json, "w") as file:
            json.dump([{"case": r.case.strip(), "figure": r.figure, "limit": r.limit, "ok": r.is_good} for r in rows], file, indent=1)
    good = all(row.is_good for row in rows)
    if good:
        shutil.rmtree(work)
    else:
        print(f"faults: logs and files lie in {work}")
    return 0 if good else 1


sys.exit(main())
