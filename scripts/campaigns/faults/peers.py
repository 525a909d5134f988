"""Cases of scripts/campaigns/faults.sh: peers that stall, lie and crowd, and a server that stands still or has no
descriptors."""
import base64
import contextlib
import os
import re
import resource
import signal
import socket
import struct
import time

from programs import (
    BIN,
    Crowd,
    Daemon,
    INSERTION,
    Relay,
    Row,
    WITNESSES,
    broker,
    gap_row,
    log_seconds,
    measure,
    metric,
    missed_percent,
    player,
    read,
    running,
    scene_with,
    start,
    wait_for,
)


def sent_queue(daemon, process):
    """Bytes that the daemon's socket to a process still holds: of /proc/net/tcp, that of the process's port."""
    inodes = set()
    for fd in os.listdir(f"/proc/{process.pid}/fd"):
        with contextlib.suppress(OSError):
            inodes.add(os.readlink(f"/proc/{process.pid}/fd/{fd}"))
    rows = [line.split() for line in read("/proc/net/tcp").splitlines()[1:]]
    own = {row[1] for row in rows if f"socket:[{row[9]}]" in inodes}
    return {
        row[2]: int(row[4].split(":")[0], 16)
        for row in rows
        if row[2] in own and row[1].endswith(f":{daemon.port:04X}")
    }


def viewers(folder, short):
    """Good viewers beside slow and stopped peers."""
    seconds = 8 if short else 20
    rows = []
    with running(Daemon(folder, "--play", "--trajectory", INSERTION)) as daemon:
        alone = measure(folder, daemon, seconds=seconds)
        rows.append(
            Row(
                "20 viewers alone",
                f"frame gap p50 {alone['gap_ms']['p50']:.1f}, p99 {alone['gap_ms']['p99']:.1f}, max "
                f"{alone['gap_ms']['max']:.1f} ms",
                "",
                alone["served"] == WITNESSES,
            )
        )
        slow = measure(folder, daemon, "--bad", "slow", seconds=seconds)
        rows.append(gap_row("beside a reader at 1 kB/s", slow, alone))
        joined, _ = daemon.says(r"(\S+) .*'slow'.* from .* joined")
        left, _ = daemon.says(r"(\S+) .*'slow' from .* left: (.*)")
        after = log_seconds(left[1]) - log_seconds(joined[1])
        dropped = re.search(r"(\d+) snapshots dropped", left[2])
        is_closed = left[2].startswith("did not read")
        rows.append(
            Row(
                "  the slow reader",
                f"{'closed' if is_closed else 'kept for'} {after:.2f} s after it joined, "
                f"{slow['bad'][0]['bytes_read']} bytes read; {dropped[1] if dropped else 0} snapshots dropped for it",
                "kept, or closed within 5 s; drops counted",
                (after <= 5 or not is_closed) and dropped,
            )
        )
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
        rows.append(
            Row(
                "  the stopped viewer",
                f"closed {closed - taken:.2f} s after it took its last byte, {closed - stopped:.2f} s "
                f"after SIGSTOP; {dropped[1] if dropped else 0} snapshots dropped; "
                f"exit {code} with the reason after SIGCONT",
                "5 s",
                closed - taken <= 5 and dropped and code == 1,
            )
        )
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
        rows.append(
            Row(
                "  the stopped device",
                f"closed and its needle free {closed - stopped:.2f} s after SIGSTOP",
                "5 s",
                closed - stopped <= 5,
            )
        )
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
    return [
        Row(
            "100 clients, 64 places",
            f"{full['served']} served, {min(busy)} of the others told BUSY ({rounds} times over)",
            "64 and 36",
            full["served"] == 64 and min(busy) == 36,
        ),
        Row(
            "  ticks missed",
            f"{missed_percent(full):.2f} % against {missed_percent(alone):.2f} % without the 36",
            "+1 %",
            more <= 1,
        ),
    ]


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
                at = [
                    wait_for("half-open peers", lambda n=count + i: len(re.findall(left, read(daemon.log))) >= n)[1]
                    for i in range(2)
                ]
                seen += [t - 1e-9 * bad["began_ns"] for t, bad in zip(at, crowd.result()["bad"])]
    return [
        Row(
            "half-open viewers and devices", f"seen after {min(seen):.2f} to {max(seen):.2f} s", "5 s", max(seen) <= 5
        )
    ]


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
        upgrade = (
            f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{daemon.http_port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n"
        ).encode()
        for length in (1 << 17, 1 << 32, (1 << 63) - 1, 1 << 63, (1 << 64) - 1):
            lie(daemon.http_port, upgrade, b"\x82\xff" + struct.pack(">Q", length) + b"mask" + b"x" * 100)
        for length in (1 << 32, (1 << 64) - 1):
            lie(
                daemon.http_port,
                (
                    f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{daemon.http_port}\r\nContent-Length: {length}" "\r\n\r\n"
                ).encode(),
            )
        for length in ((1 << 30) + 1, 1 << 32, 1 << 63, (1 << 64) - 1):
            header = struct.pack(">H12s20sQQQ", 1, b"TRANSFORM", b"NeedleToRas", 0, length, 0)
            lie(daemon.igtl_port, header + b"x" * 100)
        grown = daemon.memory_kb("VmPeak") - before
        wait_for("the descriptors", lambda: daemon.descriptors() <= held)
        code, _ = daemon.end()
    return [
        Row(
            "lengths up to 2^64 - 1",
            f"{told} lies, each closed within {1e3 * slowest:.1f} ms",
            "100 ms",
            slowest <= 0.1,
        ),
        Row(
            "  memory",
            f"address space at its peak {grown} kB above that after the first",
            "64 kB",
            grown <= 64 and code == 0,
        ),
    ]


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
    return [
        Row(
            "poses at 10 kHz",
            f"{bad['poses_sent']} sent, {crowd['poses_accepted']} accepted, {crowd['poses_refused']} refused and "
            f"counted, told {bad['errors']} times",
            "2000 a second",
            crowd["poses_accepted"] <= most and told and known < 10_000 and not bad["closed"],
        ),
        gap_row("  beside it", crowd, alone),
    ]


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
    return [
        Row(
            "SIGSTOP of the server for 2 s",
            f"{result['served']} of {WITNESSES} viewers and {int(is_playing)} of 1 devices came "
            f"through; exit {code}",
            "all",
            result["served"] == WITNESSES and is_playing and code == 0,
        ),
        Row(
            "  deadlines",
            f"{result['overruns']} missed and counted; met and missed {deadlines} in {elapsed:.2f} s: none made up for",
            "200 a second",
            result["overruns"] >= 390 and deadlines <= 200 * elapsed + 20,
        ),
    ]


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
    return [
        Row(
            "no descriptors for 2 s",
            f"{welcomed} of 10 who waited are welcomed {1e3 * waited:.0f} ms after there are some",
            "10, 500 ms",
            welcomed == 10 and waited <= 0.5,
        ),
        gap_row("  those who were there", result, alone),
    ]


def load(folder, short):
    """32 viewers with meshes, images and dose, five devices in the tissue, 200 connections that say nothing."""
    seconds = 20 if short else 300
    path = f"{folder}/scene.toml"
    with open(path, "w") as file:
        file.write(
            f'name = "load"\n[plan]\nfile = "{os.getcwd()}/config/plan.toml"\n[needle]\ncount = 5\n'
            "[probe]\non = true\n[realtime]\ncontrol_thread = true\n[server]\nmax_clients = 64\n"
        )
    with contextlib.ExitStack() as stack:
        daemon = stack.enter_context(running(Daemon(folder, "--http-port", "0", scene=path)))
        for n in range(5):
            aside = ("--translate-mm", str(8 * n - 16), "0", "0")
            stack.enter_context(running(player(daemon, folder, INSERTION, "--loop", *aside)))
        crowd = Crowd(folder, daemon, "--images", viewers=32, seconds=seconds)
        stack.enter_context(running(crowd.process))
        crowd.ready()
        silent = []
        for i in range(200):
            with contextlib.suppress(OSError):
                silent.append(socket.create_connection(("127.0.0.1", daemon.port), 2, ("127.0.0.%d" % (2 + i % 8), 0)))
        time.sleep(seconds / 2)
        half_kb = daemon.memory_kb("VmRSS")
        seen = crowd.result(seconds + 60)
        grown_mb = (daemon.memory_kb("VmRSS") - half_kb) / 1024
        turn_ms = 1e3 * metric(daemon, "brachy_io_turn_seconds_max")
        for peer in silent:
            peer.close()
        code, ended = daemon.end()
    more = missed_percent(seen) - 100.0 * seen["control_overruns"] / max(1, seen["ticks"] + seen["overruns"])
    gap = seen["gap_ms"]
    return [
        Row(
            "32 viewers, 5 devices, 200 silent",
            f"{seen['served']} viewers served for {seconds} s, {seen['images']} images, frame gap p50 "
            f"{gap['p50']:.1f}, p99 {gap['p99']:.1f} ms",
            "32 served, with images",
            seen["served"] == 32 and seen["images"] > 0,
        ),
        Row("  ticks missed", f"{more:+.2f} % against the control thread", "+0.5 %", more <= 0.5),
        Row("  longest turn of the io thread", f"{turn_ms:.2f} ms of processor time", "2 ms", turn_ms <= 2),
        Row("  memory", f"{grown_mb:+.1f} MB in the second half", "8 MB", grown_mb <= 8),
        Row("  SIGTERM after it", f"exit {code} after {ended:.2f} s", "0 within 2 s", code == 0 and ended <= 2),
    ]


def relay(folder, short):
    """64 viewers behind a relay of one session that two daemons publish at once, one of them begun again and again."""
    seconds, viewers_of_relay = (10 if short else 60), 64
    with contextlib.ExitStack() as stack:
        nats = stack.enter_context(broker(folder))
        if not nats:
            return [Row("relay", "skipped: no nats-server", "", True)]
        publish = ("--nats", nats, "--play", "--trajectory", INSERTION)
        stack.enter_context(running(Daemon(folder, *publish, name="first")))
        behind = stack.enter_context(running(Relay(folder, nats)))
        most_kb, rounds, served, end = 0, 0, 0, time.monotonic() + seconds
        while time.monotonic() < end:
            rounds += 1
            with running(Daemon(folder, *publish, name=f"second{rounds}")):
                crowd = Crowd(folder, behind, viewers=viewers_of_relay, seconds=4.0)
                with running(crowd.process):
                    while crowd.process.poll() is None:
                        most_kb = max(most_kb, behind.memory_kb("VmRSS"))
                        time.sleep(0.1)
                served += crowd.process.returncode == 0
        peak_mb, left_mb = most_kb / 1024, behind.memory_kb("VmRSS") / 1024
        is_there = behind.process.poll() is None
    return [
        Row(
            "relay of two publishers",
            f"{peak_mb:.0f} MB at most, {left_mb:.0f} MB at the end, {rounds} times {viewers_of_relay} viewers, "
            f"of which {served} crowds were served; it {'runs' if is_there else 'has ended'}",
            "64 MB",
            peak_mb <= 64 and is_there,
        )
    ]
