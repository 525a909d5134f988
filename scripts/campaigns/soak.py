"""The clients of soak.sh, and what it measured.

soak.py run DAEMON_OUT PID SECONDS WORK CSV     plays rounds of clients against the daemon that wrote DAEMON_OUT
soak.py judge SECONDS CSV DAEMON_OUT SVG        judges and draws
"""
import csv
import json
import os
import random
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import time

# Of a round the last seconds are quiet: longer than the 5 s after which a silent peer is closed.
ROUND_S, QUIET_S = 30, 8
CHURN_PER_S = 4
BRACHY = "build/release/bin/brachy"
VIEWER, OPERATOR, KERNELS = 1, 3, ["psi30", "psi31", "psi32", "buhmann", "compact_elastic"]
NAN = float("nan")
WARM_UP_S, GROWTH_MB, SLOPE_MB_PER_H, SLOPE_FROM_S = 120, 5, 1, 7200


def message(kind, sequence, body):
    return b"BRCY" + struct.pack("<HHIIQQ", 1, kind, 0, len(body), sequence, time.monotonic_ns()) + body


def hello(role, subscription=0):
    name = b"soak"
    return message(1, 1, struct.pack("<HHI4dH", role, 0, subscription, *4 * (NAN,), len(name)) + name + bytes(4))


def control(sequence, action, kernel=b""):
    return message(15, sequence, struct.pack("<HHIdH", action, 0, 0, NAN, len(kernel)) + kernel + bytes(4))


class Peer:
    """A connection that sends what it is given and reads, if it does, without looking at it."""

    def __init__(self, port, sends=b"", reads=True, reset=False):
        self.reads = reads
        self.socket = socket.socket()
        if not reads:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        if reset:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.connect(("127.0.0.1", port))
        self.send(sends)

    def send(self, data):
        try:
            self.socket.sendall(data)
        except OSError:
            pass  # it was thrown out: as it should be

    def read(self):
        """False where the connection has ended."""
        try:
            return bool(self.socket.recv(1 << 18))
        except OSError:
            return False

    def close(self):
        self.socket.close()


class Soak:
    def __init__(self, ports, pid, work):
        self.native, self.http, self.igtl = ports
        self.pid, self.work = pid, work
        self.random = random.Random(9)
        self.peers = {}  # Peer: when it leaves
        self.counts = {}
        self.device = None
        self.recorder = None

    def start_device(self):
        self.device = subprocess.Popen(
            [BRACHY, "replay", "config/insertion.csv", "--connect", f"127.0.0.1:{self.native}", "--loop"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def recording(self):
        return os.path.join(self.work, "soak.brachy")

    def start_recorder(self):
        self.recorder = subprocess.Popen(
            [
                BRACHY,
                "record",
                "--connect",
                f"127.0.0.1:{self.native}",
                "--out",
                self.recording(),
                "--duration",
                "10",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def end_recorder(self):
        code = self.recorder.wait(30)
        check = subprocess.run(
            [BRACHY, "inspect", self.recording()], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        if code or check.returncode:
            raise SystemExit(f"soak: recorder ended with {code}, its file's inspection with {check.returncode}")
        os.remove(self.recording())

    def come(self):
        """One more client, of a random kind."""
        kinds = [
            self.polite,
            self.surface,
            self.cut_hello,
            self.reset,
            self.garbage,
            self.deaf,
            self.silent,
            self.half_request,
            self.page,
            self.tracker,
            self.operator,
        ]
        kind = self.random.choice(kinds)
        self.counts[kind.__name__] = self.counts.get(kind.__name__, 0) + 1
        try:
            peer = kind()
        except OSError:
            return  # no place
        self.peers[peer] = time.monotonic() + self.random.uniform(0.1, 4)

    def polite(self):
        return Peer(self.native, hello(VIEWER))

    def surface(self):
        return Peer(self.native, hello(VIEWER, 4))

    def cut_hello(self):
        whole = hello(VIEWER)
        return Peer(self.native, whole[: self.random.randrange(len(whole))])

    def reset(self):
        return Peer(self.native, hello(VIEWER), reset=True)

    def garbage(self):
        port = self.random.choice([self.native, self.http, self.igtl])
        return Peer(port, self.random.randbytes(self.random.randrange(1, 4000)))

    def deaf(self):
        return Peer(self.native, hello(VIEWER, 1), reads=False)

    def silent(self):
        return Peer(self.random.choice([self.native, self.http, self.igtl]))

    def half_request(self):
        return Peer(self.http, b"GET / HTTP/1.1\r\nHost: 127.0.0.1")

    def page(self):
        return Peer(
            self.http,
            f"GET /index.html HTTP/1.1\r\nHost: 127.0.0.1:{self.http}\r\nAccept-Encoding: gzip\r\n\r\n".encode(),
        )

    def tracker(self):
        header = struct.pack(">H12s20sQQQ", 1, b"GET_CAPABIL", b"soak", 0, 0, 0)
        return Peer(self.igtl, header)

    def operator(self):
        peer = Peer(self.native, hello(OPERATOR, 8))
        if self.random.random() < 0.3:
            peer.send(control(2, 4, self.random.choice(KERNELS).encode()))
        elif self.random.random() < 0.3:
            peer.send(control(2, 3))
        return peer

    def leave(self, peer):
        peer.close()
        del self.peers[peer]

    def churn_until(self, end):
        """Clients come and go; then all of them leave."""
        next_s = time.monotonic()
        while (now := time.monotonic()) < end:
            if now >= next_s:
                self.come()
                next_s = now + self.random.expovariate(CHURN_PER_S)
            for peer in [peer for peer, leaves in self.peers.items() if leaves <= now]:
                self.leave(peer)
            reading = {peer.socket: peer for peer in self.peers if peer.reads}
            wait = max(0, min(next_s, end) - time.monotonic())
            if not reading:
                time.sleep(min(wait, 0.05))
                continue
            for ready in select.select(list(reading), [], [], min(wait, 0.05))[0]:
                if not reading[ready].read():
                    self.leave(reading[ready])
        for peer in list(self.peers):
            self.leave(peer)

    def sample(self):
        with open(f"/proc/{self.pid}/status") as status:
            rss_kb = next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))
        return rss_kb / 1024, len(os.listdir(f"/proc/{self.pid}/fd"))


def run(daemon_out, pid, seconds, work, csv_path):
    with open(daemon_out) as out:
        text = out.read()
    ports = [
        int(re.search(rf'^{{"{name}":".*:(\d+)"}}$', text, re.M).group(1))
        for name in ("listening_on", "http_on", "igtl_on")
    ]
    soak = Soak(ports, pid, work)
    viewers = [
        subprocess.Popen(
            [BRACHY, "watch", "--connect", f"127.0.0.1:{ports[0]}", "--json"] + extra,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        for extra in ([], [], ["--full"])
    ]
    start = time.monotonic()
    status = 0
    try:
        soak.start_device()
        with open(csv_path, "w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["t_s", "rss_mb", "descriptors"])
            number = 0
            while time.monotonic() - start < seconds:
                begin = start + number * ROUND_S
                soak.start_recorder()
                soak.churn_until(begin + ROUND_S - QUIET_S)
                if soak.random.random() < 0.3:
                    soak.device.kill()
                    soak.device.wait()
                    soak.start_device()
                soak.end_recorder()
                time.sleep(max(0, begin + ROUND_S - time.monotonic()))
                rss_mb, descriptors = soak.sample()
                rows.writerow([f"{time.monotonic() - start:.1f}", f"{rss_mb:.2f}", descriptors])
                file.flush()
                number += 1
                print(
                    f"soak: {time.monotonic() - start:6.0f} of {seconds} s: {rss_mb:.1f} MB, "
                    f"{descriptors} descriptors, "
                    f"{sum(soak.counts.values())} clients came and went",
                    flush=True,
                )
                for process in [*viewers, soak.device]:
                    if process.poll() is not None:
                        raise SystemExit(f"soak: {' '.join(process.args)} ended by itself, with {process.returncode}")
    finally:
        if soak.device:
            soak.device.kill()
        for viewer in viewers:
            viewer.send_signal(signal.SIGINT)
        for viewer in viewers:
            report = json.loads(viewer.communicate(timeout=30)[0].splitlines()[-1])
            print(
                f"soak: a viewer that stayed: {report['snapshots_hz']:.1f} snapshots a second, "
                f"{report['seq_gaps']} sequence gaps"
            )
            status |= report["seq_gaps"] > 0
    print("soak: " + ", ".join(f"{count} {name}" for name, count in sorted(soak.counts.items())))
    return status


def theil_sen(xs, ys):
    slopes = sorted((ys[j] - ys[i]) / (xs[j] - xs[i]) for i in range(len(xs)) for j in range(i))
    return slopes[len(slopes) // 2] if slopes else 0.0


def judge(seconds, csv_path, daemon_out, svg):
    with open(csv_path) as file:
        samples = [(float(row["t_s"]), float(row["rss_mb"]), int(row["descriptors"])) for row in csv.DictReader(file)]
    warm = [sample for sample in samples if sample[0] >= WARM_UP_S]
    if len(warm) < 2:
        raise SystemExit("soak: too short to say anything: two rounds after the warm-up of 2 minutes at least")
    t_s, rss_mb, descriptors = zip(*warm)
    growth_mb = max(rss_mb) - rss_mb[0]
    slope = 3600 * theil_sen(t_s, rss_mb)
    with open(daemon_out) as out:
        intervals = [json.loads(line) for line in out if line.startswith('{"interval_end_s"')]
    ticks = sum(i["ticks"] for i in intervals)
    missed = 100 * sum(i["overruns"] for i in intervals) / ticks
    draw(samples, intervals, svg)
    checks = [
        (f"memory after 2 minutes: +{growth_mb:.2f} MB", growth_mb < GROWTH_MB or seconds >= SLOPE_FROM_S),
        (f"descriptors: {min(descriptors)} to {max(descriptors)}", len(set(descriptors)) == 1),
    ]
    if seconds >= SLOPE_FROM_S:
        checks.append((f"slope of the memory: {slope:.2f} MB/h", slope < SLOPE_MB_PER_H))
    for text, good in checks:
        print(f"soak: {text}: {'ok' if good else 'MISSED'}")
    print(f"soak: slope {slope:.2f} MB/h (Theil–Sen); {ticks} ticks, {missed:.3f} % missed; chart in {svg}")
    return 0 if all(good for _, good in checks) else 1


def draw(samples, intervals, svg):
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    figure, (memory, held, ticks) = plt.subplots(
        3, 1, sharex=True, figsize=(8, 7), gridspec_kw={"height_ratios": [2, 1, 3]}
    )
    minutes = [t / 60 for t, _, _ in samples]
    memory.plot(minutes, [rss for _, rss, _ in samples], ".-")
    memory.set_ylabel("resident, MB")
    memory.set_ylim(0, None)
    held.step(minutes, [count for _, _, count in samples], where="mid")
    held.set_ylabel("descriptors")
    held.set_ylim(0, None)
    at = [i["interval_end_s"] / 60 for i in intervals]
    for name, label in (("max", "max"), ("p999", "p99.9"), ("p99", "p99"), ("p50", "p50")):
        ticks.plot(at, [i["tick_ms"][name] for i in intervals], label=label, linewidth=1)
    ticks.axhline(5, color="grey", linestyle=":", label="budget")
    ticks.set_yscale("log")
    ticks.set_ylabel("tick in each 10 s, ms")
    ticks.set_xlabel("minutes")
    ticks.legend(ncol=5, fontsize="small")
    figure.tight_layout()
    figure.savefig(svg)


if sys.argv[1] == "run":
    sys.exit(run(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), sys.argv[5], sys.argv[6]))
sys.exit(judge(int(sys.argv[2]), *sys.argv[3:6]))
