"""Cases of scripts/campaigns/faults.sh: a full disk, and programs that are ended."""
import json
import math
import os
import re
import shutil
import signal
import socket
import subprocess
import time

from programs import BIN, Crowd, Daemon, INSERTION, Row, measure, player, read, recorder, running


def inspected(recording):
    done = subprocess.run(
        [BIN + "brachy", "inspect", recording, "--json"], capture_output=True, text=True, check=False
    )
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
    tried = subprocess.run(
        ["unshare", "-rm", "sh", "-c", f"mount -t tmpfs -o size=1m tmpfs {folder}"], capture_output=True, check=False
    )
    if tried.returncode != 0:
        reason = tried.stderr.decode().strip()
        return [Row("full disk", "skipped: no file system may be mounted here: " + reason, "", True)]

    def before(kept, size):
        os.makedirs(f"{folder}/disk", exist_ok=True)
        script = (
            f'mount -t tmpfs -o size={size} tmpfs {folder}/disk && {{ "$@"; code=$?; '
            f'cp -r {folder}/disk {folder}/{kept}; '
            "exit $code; }"
        )
        return ["unshare", "-rm", "sh", "-c", script, "sh"]

    with running(
        Daemon(
            folder,
            "--play",
            "--trajectory",
            INSERTION,
            "--session",
            f"{folder}/disk/session",
            "--duration",
            "40",
            before=before("kept", "128k"),
        )
    ) as daemon:
        crowd = Crowd(folder, daemon, viewers=1, seconds=60)
        with running(crowd.process):
            crowd.ready()
            daemon.says("session: .*No space left", 30)
            told = len(re.findall("error.*session: ", read(daemon.log)))
            code = daemon.process.wait(60)
            result = crowd.stop()
        poses, forces, _ = session_rows(f"{folder}/kept/session")
    rows = [
        Row(
            "full disk under --session",
            f"said {told} time in the log, the daemon went on ({result['ticks']} ticks, exit {code}); "
            f"{len(poses)} poses and {len(forces)} forces are whole",
            "once, readable",
            told == 1 and code == 0 and len(poses) > 1000,
        )
    ]
    with running(Daemon(folder, "--play", "--trajectory", INSERTION, name="brachyd2")) as daemon:
        record = subprocess.run(
            [
                *before("recorded", "1m"),
                BIN + "brachy",
                "record",
                "--connect",
                daemon.address,
                "--out",
                f"{folder}/disk/r.brachy",
            ],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        found = inspected(f"{folder}/recorded/r.brachy")
    rows.append(
        Row(
            "full disk under `brachy record`",
            f"exit {record.returncode}: …{record.stderr.strip()[-90:]}; "
            f"{os.path.getsize(folder + '/recorded/r.brachy')} bytes, damage: {found['damage']}",
            "exit 1, readable",
            record.returncode == 1 and "No space left" in record.stderr and found["damage"] is None,
        )
    )
    return rows


def kill(folder, short):
    """kill -9 of the daemon and of the recorder during a session with seeds."""
    needles = f"{folder}/needles.csv"
    subprocess.run(
        [BIN + "brachy", "plan", "--force", "--config", "config/session.toml", "--trajectory", needles],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    rows = []
    for killed in ("daemon", "recorder"):
        work = f"{folder}/{killed}"
        os.makedirs(work)
        with running(Daemon(work, "--session", f"{work}/session", scene="config/session.toml")) as daemon, running(
            recorder(daemon, work)
        ) as record, running(player(daemon, work, needles, "--speed", "2")):
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
            rows.append(
                Row(
                    f"kill -9 of the {killed}",
                    f"the recording ends {lost:.3f} s before what a witness saw, with {seeds} of its "
                    f"{seen['seeds']} seeds; damage: {found['damage']}",
                    "1 s",
                    lost <= 1 and found["damage"] is None and seeds >= seen["seeds"] - 1 and seen["seeds"] > 0,
                )
            )
            if killed == "recorder":
                daemon.end()
                continue
            poses, _, ledger = session_rows(f"{work}/session")
            behind = 0.005 * seen["last_tick"] - float(poses[-1][0])
            rows.append(
                Row(
                    "  session and ledger",
                    f"poses end {behind:.3f} s before it; {len(ledger)} seeds are in the ledger, it saw "
                    f"{seen['seeds']}",
                    "1 s, every seed",
                    behind <= 1 and len(ledger) >= seen["seeds"],
                )
            )
        if killed == "daemon":
            again = Daemon(work, "--session", f"{work}/session", scene="config/session.toml", name="again")
            with running(again) as daemon:
                text, _ = daemon.says(r"(\d+) seeds of an earlier run")
                again = measure(work, daemon, "--surface", viewers=1, seconds=0.5)
                daemon.end()
            rows.append(
                Row(
                    "  the next daemon",
                    f"goes on with {again['seeds']} seeds",
                    f"{len(ledger)}",
                    again["seeds"] == len(ledger) == int(text[1]),
                )
            )
    return rows


def sigterm(folder, short):
    """SIGTERM under load."""
    times, bad = [], []
    count = 10 if short else 100
    for i in range(count):
        work = f"{folder}/{i}"
        os.makedirs(work)
        with running(
            Daemon(work, "--session", f"{work}/session", "--http-port", "0", "--igtl-port", "0")
        ) as daemon, running(player(daemon, work, INSERTION, "--loop")) as replay, running(
            recorder(daemon, work)
        ) as record:
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
    return [
        Row(
            f"SIGTERM under load, {count} times",
            f"exit 0 within {max(times):.2f} s, mean {sum(times) / count:.2f} s; recording "
            f"and session readable {count - len(bad)} times" + "".join("; " + b for b in bad[:2]),
            "2 s, each time",
            max(times) <= 2 and not bad,
        )
    ]


def seconds_to_refuse(port):
    begin = time.monotonic()
    ended = subprocess.run([BIN + "brachyd", "--port", str(port)], capture_output=True, check=False)
    return time.monotonic() - begin if ended.returncode == 2 else math.inf


def start_stop(folder, short):
    """Start and stop on one port, by SIGTERM and SIGINT in turn."""
    count = 10 if short else 100
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    slowest = slowest_start = 0.0
    good, before = 0, set(os.listdir("/dev/shm")) | set(os.listdir("/tmp"))
    for i in range(count):
        begin = time.monotonic()
        with running(Daemon(folder, port=port)) as daemon:
            slowest_start = max(slowest_start, time.monotonic() - begin)
            if i == 0:
                refused = seconds_to_refuse(port)
            with socket.create_connection(("127.0.0.1", port), 5):
                code, seconds = daemon.end(signal.SIGINT if i % 2 else signal.SIGTERM)
        slowest = max(slowest, seconds)
        good += code == 0
    left = (set(os.listdir("/dev/shm")) | set(os.listdir("/tmp"))) - before
    left = {name for name in left if "brachy" in name and not folder.endswith(name)}
    return [
        Row(
            f"start and stop, {count} times",
            f"{good} times exit 0 on one port; up within {slowest_start:.2f} s, ended within "
            f"{slowest:.2f} s; {len(left)} files left",
            f"{count}, 2 s",
            good == count and slowest <= 2 and not left,
        ),
        Row("a port in use", f"refused within {refused:.2f} s", "5 s", refused <= 5),
    ]
