#!/usr/bin/env python3
"""Compares what two builds send on the wire and what they record. Called by scripts/same_bits.sh.

    same_bits_wire.py OLD_BIN_DIR NEW_BIN_DIR SCENE_DIR WORK_DIR

- server to client: WELCOME, TOPOLOGY, SCENE, FRAME, DOSE. A device of this script leaves seeds; FRAMEs are compared
tick by tick.
- server to device: FORCE and LOCAL_MODEL once the force of a resting needle is constant.
- client to server: HELLO of `brachy watch`, `record` and `replay`.
- recording: both `brachy record` are given the same bytes of one server. The files must be the same.

Masked, since they hold clocks or counts of what the machine had time for: the header's sequence and stamp_ns; of FRAME
snapshot_sequence, overruns, publish_ns and the stamps and sequences of poses; of FORCE and LOCAL_MODEL tick and the
pose's sequence and stamp; of WELCOME the session's number. Not compared: STATE, PING, and EVENT, whose texts are for
people. Their layout is compared with net/PROTOCOL.md by the tests.
"""
import hashlib
import pathlib
import socket
import struct
import subprocess
import sys
import threading
import time

HELLO, WELCOME, TOPOLOGY, FRAME, POSE, FORCE, LOCAL_MODEL, DROP, DOSE, SCENE = 1, 2, 3, 4, 5, 10, 11, 13, 14, 16
FULL_FRAMES, POSE_HISTORY, WITH_SCENE, NO_MESH = 1, 2, 16, 8
FORCE_SECTION = 1
LEAST_FRAMES = 80  # to be compared
START = 20  # tick of the first pose
PERIOD_S = 0.1  # of the scene that is used here


class Peer:
    """A client that knows headers only."""

    def __init__(self, address, role, subscription, sections=()):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=5)
        self.sequence = 0
        self.raw = bytearray()
        self.left = b""
        nan = float("nan")
        body = struct.pack("<HHIdddd", role, 0, subscription, 3.3, 1.0, nan, 200.0 if role == 2 else nan)
        body += struct.pack("<H", 4) + b"peer" + struct.pack("<H", len(sections)) + b"\0\0"
        for number, payload in sections:
            body += struct.pack("<HHI", number, 0, len(payload)) + payload
        self.send(HELLO, body)

    def send(self, kind, body):
        self.sequence += 1
        stamp = time.monotonic_ns()
        self.socket.sendall(struct.pack("<4sHHIIQQ", b"BRCY", 1, kind, 0, len(body), self.sequence, stamp) + body)

    def messages(self, seconds):
        """Yields (type, flags, body) until the time is over or the server closes."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.socket.settimeout(0.05)
            try:
                data = self.socket.recv(1 << 20)
            except TimeoutError:
                yield None
                continue
            if not data:
                return
            self.raw += data
            self.left += data
            while len(self.left) >= 32:
                _, _, kind, flags, length = struct.unpack_from("<4sHHII", self.left)
                if len(self.left) < 32 + length:
                    break
                body = self.left[32:32 + length]
                self.left = self.left[32 + length:]
                yield kind, flags, body


def masked(body, *ranges):
    body = bytearray(body)
    for first, end in ranges:
        body[first:end] = bytes(end - first)
    return bytes(body)


def masked_frame(body):
    """A FRAME's body without clocks, and the number of its tick."""
    body = bytearray(masked(body, (24, 32), (40, 80)))
    tick, = struct.unpack_from("<Q", body, 8)
    needle_count, = struct.unpack_from("<H", body, 104)
    at = 108 + 116 * needle_count
    range_count, = struct.unpack_from("<I", body, at)
    at += 4
    points = sum(struct.unpack_from("<II", body, at + 8 * i)[1] for i in range(range_count))
    at += 8 * range_count + 12 * points
    section_count, = struct.unpack_from("<H", body, at)
    at += 4
    for _ in range(section_count):
        number, _, length = struct.unpack_from("<HHI", body, at)
        at += 8
        if number == FORCE_SECTION:
            for entry in range(struct.unpack_from("<H", body, at)[0]):
                first = at + 4 + 136 * entry
                body[first + 8:first + 24] = bytes(16)
        at += length
    assert at == len(body), (at, len(body))
    return tick, bytes(body)


class Daemon:
    def __init__(self, bin_dir, log, *options):
        self.log = open(log, "w")
        self.process = subprocess.Popen([f"{bin_dir}/brachyd", "--port", "0", "--simd", "sse4", *options],
                                        stdout=subprocess.PIPE, stderr=self.log, text=True)
        line = self.process.stdout.readline()
        assert line.startswith("brachyd listening on "), (line, pathlib.Path(log).read_text())
        self.address = line.split()[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(20)
        self.log.close()


def poses_by_tick(trajectory, period_s):
    """Samples a trajectory once a tick: [(tip, button)]. Its needles are parallel to z."""
    lines = [line for line in trajectory.read_text().splitlines() if line and not line.startswith("#")]
    rows = [[float(value) for value in line.split(",")] for line in lines[1:]]
    poses, row = [], 0
    while len(poses) * period_s <= rows[-1][0]:
        t = len(poses) * period_s
        while row + 2 < len(rows) and rows[row + 1][0] <= t:
            row += 1
        a, b = rows[row], rows[row + 1]
        share = min(1.0, (t - a[0]) / (b[0] - a[0]))
        poses.append(([x + share * (y - x) for x, y in ((a[i], b[i]) for i in (4, 8, 12))], int(a[13])))
    return poses


def drive(bin_dir, work, side, scene, poses):
    """What a device is sent that takes a needle through `poses`, one a tick from tick START on, and what a recorder
    is sent: {name: bytes}, FRAMEs by tick and DOSEs by their number of seeds; the recorder's stream."""
    seen = {}
    seconds = (START + len(poses)) * PERIOD_S + 2
    with Daemon(bin_dir, work / f"{side}_driven.log", "--config", scene) as daemon:
        device = Peer(daemon.address, 2, FULL_FRAMES | WITH_SCENE)
        recorder = Peer(daemon.address, 1, POSE_HISTORY | WITH_SCENE)
        end = threading.Event()
        drained = threading.Thread(target=lambda: next(
            (None for _ in recorder.messages(seconds) if end.is_set()), None))
        drained.start()
        button = last = 0
        for message in device.messages(seconds):
            if not message:
                continue
            kind, _, body = message
            if kind == WELCOME:
                seen["WELCOME"] = masked(body, (0, 8))
            elif kind == TOPOLOGY:
                seen["TOPOLOGY"] = body
            elif kind == SCENE:
                seen["SCENE"] = body
            elif kind == DOSE:
                seen[f"DOSE {struct.unpack_from('<I', body)[0]}"] = body
            elif kind == FRAME:
                # The pose of the next tick goes out as soon as this tick's mesh has come: most of a period before it
                # is used.
                tick, seen_frame = masked_frame(body)
                seen[f"FRAME {tick}"] = seen_frame
                step = tick + 1 - START
                if tick == last:
                    continue
                last = tick
                if step >= len(poses):
                    break
                if step >= 0:
                    (x, y, z), pressed = poses[step]
                    device.send(POSE, struct.pack("<HHI12d", 0, 0, 0, 1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z))
                    if pressed != button:
                        button = pressed
                        device.send(DROP, struct.pack("<HHI", 0, button, 0))
        end.set()
        drained.join()
    return seen, bytes(recorder.raw)


def hold(bin_dir, work, side, scene):
    """What a device is sent whose needle presses on the tissue and rests: FORCE and LOCAL_MODEL at the end."""
    seen = {}
    with Daemon(bin_dir, work / f"{side}_held.log", "--config", scene) as daemon:
        device = Peer(daemon.address, 2, NO_MESH, [(1, struct.pack("<HHI", 0, 1, 0))])
        begin = time.monotonic()
        z = -30.0
        last = 0
        for message in device.messages(4):
            now = time.monotonic()
            if now - last > 0.02:
                last = now
                z = -30.0 if now - begin < 1 else -20.0
                pose = (1, 0, 0, 0.5, 0, 1, 0, -1.0, 0, 0, 1, z)
                device.send(POSE, struct.pack("<HHI12d", 0, 0, 0, *pose))
            if message and message[0] == FORCE:
                seen["FORCE"] = masked(message[2], (8, 32))
            elif message and message[0] == LOCAL_MODEL:
                seen["LOCAL_MODEL"] = masked(message[2], (8, 32))
    return seen


def first_bytes_of(program, stream):
    """Starts a program against a server that sends `stream` to it; returns the HELLO that the program sent, masked."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(20)
        client = subprocess.Popen([*program, "--connect", f"127.0.0.1:{server.getsockname()[1]}"],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        connection, _ = server.accept()
        with connection:
            connection.settimeout(20)
            hello = b""
            while len(hello) < 32 or len(hello) < 32 + struct.unpack_from("<I", hello, 12)[0]:
                hello += connection.recv(4096)
            if stream:
                connection.sendall(stream)
                connection.shutdown(socket.SHUT_WR)
                try:
                    while connection.recv(4096):
                        pass
                except OSError:
                    pass
        try:
            client.wait(20)
        except subprocess.TimeoutExpired:
            client.kill()
            client.wait()
        length = 32 + struct.unpack_from("<I", hello, 12)[0]
        return masked(hello[:length], (24, 32))


def same(name, old, new, how=""):
    equal = old == new and bool(old)
    digest = hashlib.sha256(new or b"").hexdigest()[:16]
    print(f"{'same      ' if equal else 'DIFFERENT '} wire {name}: {len(old or b'')} bytes, {digest}{how}", flush=True)
    if not equal and old and new:
        first = next((i for i, (a, b) in enumerate(zip(old, new)) if a != b), min(len(old), len(new)))
        print(f"           lengths {len(old)} and {len(new)}, first difference at byte {first}", flush=True)
    return equal


def common_keys(shown, kind):
    return sorted((key for key in shown["old"] if key in shown["new"] and key.startswith(kind + " ")),
                  key=lambda key: int(key.split()[1]))


def main():
    old, new, scenes, work = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), pathlib.Path(sys.argv[4])
    sides = {"old": old, "new": new}
    # A light scene at a slow rate, so that no tick is missed on a busy machine.
    scene = work / "wire.toml"
    scene.write_text('name = "wire"\n[tissue]\npoints = 1500\n[rates]\ndeformation_hz = 10\nsnapshot_hz = 100\n'
                     f'[plan]\nfile = "{scenes}/plan.toml"\n[seeds]\napplicator = "train"\n')
    session = work / "wire_session.csv"
    subprocess.run([f"{old}/brachy", "plan", "--config", str(scene), "--trajectory", str(session), "--speed-mm-s", "60",
                    "--drop-speed-mm-s", "40"], check=True, stdout=subprocess.DEVNULL)
    poses = poses_by_tick(session, PERIOD_S)[:130]
    good = True
    shown, streams, held = {}, {}, {}
    for attempt in range(3):
        # A busy machine may be late with a pose even so: it is used a tick later then, so try again.
        for side, bin_dir in sides.items():
            shown[side], streams[side] = drive(bin_dir, work, side, str(scene), poses)
        common = common_keys(shown, "FRAME")
        if len(common) >= LEAST_FRAMES and all(shown["old"][k] == shown["new"][k] for k in common):
            break
    for side, bin_dir in sides.items():
        held[side] = hold(bin_dir, work, side, str(scene))
    for name in ("WELCOME", "TOPOLOGY", "SCENE"):
        good &= same(name, shown["old"].get(name), shown["new"].get(name))
    for kind, least in (("FRAME", LEAST_FRAMES), ("DOSE", 1)):
        common = common_keys(shown, kind)
        differ = [k for k in common if shown["old"][k] != shown["new"][k]]
        how = f", {len(common)} messages in both of {sum(k.startswith(kind + ' ') for k in shown['old'])}"
        good &= same(kind, b"".join(shown["old"][k] for k in common), b"".join(shown["new"][k] for k in common), how)
        if differ:
            print(f"           first different: {differ[0]}, {len(differ)} in all", flush=True)
        if len(common) < least:
            print(f"DIFFERENT  wire {kind}: only {len(common)} messages to compare", flush=True)
            good = False
    for name in ("FORCE", "LOCAL_MODEL"):
        good &= same(name, held["old"].get(name), held["new"].get(name))
    files = {}
    hellos = {}
    for side, bin_dir in sides.items():
        target = work / f"{side}_recording.brachy"
        hellos[side, "record"] = first_bytes_of([f"{bin_dir}/brachy", "record", "--out", str(target)], streams["old"])
        files[side] = target.read_bytes() if target.exists() else b""
        hellos[side, "watch"] = first_bytes_of([f"{bin_dir}/brachy", "watch"], streams["old"])
        hellos[side, "replay"] = first_bytes_of([f"{bin_dir}/brachy", "replay", str(session)], b"")
    for tool in ("record", "watch", "replay"):
        good &= same(f"HELLO of {tool}", hellos["old", tool], hellos["new", tool])
    good &= same("recording of the same stream", files["old"], files["new"])
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
