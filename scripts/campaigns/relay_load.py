"""Measures and draws for scripts/campaigns/relay_load.sh.   relay_load.py JSON DIR [--quick]"""
import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

BIN = Path("build/release/bin")
VIEWER_COUNTS = [1, 10, 50, 200]
SECONDS = 15  # the needle's whole way, which it goes over and over
# Each with programs restarted: how the daemons' ticks fall beside each other differs, and with it what they find in
# the caches.
TIMES = 4
SHARE = 1.10  # of what one viewer beside the daemon costs
plt.style.use(Path(__file__).parents[1] / "charts/brachyd.mplstyle")


def processor_s(process):
    """User and system time of a process since its start."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def place(is_daemon):
    """Daemons have a core of their own: the caches and turns of others are no cost of the viewers."""
    cores = sorted(os.sched_getaffinity(0))
    if len(cores) > 1:
        os.sched_setaffinity(0, cores[:1] if is_daemon else cores[1:])


@contextlib.contextmanager
def running(command, is_daemon=False, **options):
    process = subprocess.Popen(
        [str(part) for part in command], text=True, preexec_fn=lambda: place(is_daemon), **options
    )
    try:
        yield process
    finally:
        process.terminate()
        process.wait(20)


def port_of(process, program):
    line = process.stdout.readline()
    found = re.match(rf"{program} listening on .*:(\d+)$", line)
    if not found:
        raise SystemExit(f"relay_load: {program} said: {line!r}")
    return int(found[1])


def crowd(stack, port, viewers):
    """So many viewers of the surface at `port`, once all are there."""
    command = [BIN / "brachy_crowd", "--port", port, "--viewers", viewers, "--surface", "--seconds", 600]
    process = stack.enter_context(running(command, stdout=subprocess.PIPE))
    if process.stdout.readline() != "ready\n":
        raise SystemExit("relay_load: the crowd did not come")
    return process


def last_words(process, viewers):
    process.send_signal(signal.SIGINT)
    seen = json.loads(process.stdout.readline())
    if seen["served"] != viewers:
        raise SystemExit(f"relay_load: {seen['served']} of {viewers} viewers were served: {seen['closed']}")
    return seen


def measure_once(scene, url, broker, viewers):
    """Three daemons at once, so that whatever else the machine does is the same for all: one with a viewer, one with
    all of them beside it, one with all of them behind the relay. Their processor time, the relay's and the broker's,
    and what viewers saw."""
    with contextlib.ExitStack() as stack:

        def start(command, program, **options):
            process = stack.enter_context(
                running(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, **options)
            )
            return process, port_of(process, program)

        daemon = [BIN / "brachyd", "--config", scene, "--port", 0]
        one, one_port = start(daemon, "brachyd", is_daemon=True)
        direct, direct_port = start(daemon, "brachyd", is_daemon=True)
        published, _ = start([*daemon, "--nats", url], "brachyd", is_daemon=True)
        relay, relay_port = start([BIN / "brachy", "relay", "--nats", url, "--port", 0], "brachy relay")
        watching = [
            (crowd(stack, one_port, 1), 1),
            (crowd(stack, direct_port, viewers), viewers),
            (crowd(stack, relay_port, viewers), viewers),
        ]
        time.sleep(1)
        begin, before = time.monotonic(), [processor_s(p) for p in (one, direct, published, relay, broker)]
        time.sleep(SECONDS)
        passed, after = time.monotonic() - begin, [processor_s(p) for p in (one, direct, published, relay, broker)]
        seen = [last_words(*crowd) for crowd in watching]
    return [100 * (b - a) / passed for b, a in zip(after, before)], seen


def measure(scene, url, broker, viewers):
    runs = [measure_once(scene, url, broker, viewers) for _ in range(TIMES)]
    names = ["one_percent", "direct_percent", "behind_percent", "relay_percent", "broker_percent"]
    row = {
        "viewers": viewers,
        **{n: sum(run[0][i] for run in runs) / TIMES for i, n in enumerate(names)},
        "runs": [dict(zip(names, run[0])) for run in runs],
        "gap_p50_ms": [max(run[1][k]["gap_ms"]["p50"] for run in runs) for k in range(3)],
        "gap_p99_ms": [max(run[1][k]["gap_ms"]["p99"] for run in runs) for k in range(3)],
    }
    row["ratio"] = row["behind_percent"] / row["one_percent"]
    print(
        f"{viewers:4} viewers: daemon {row['direct_percent']:.1f} % of a core beside it, "
        f"{row['behind_percent']:.1f} % behind the "
        f"relay, {row['ratio']:.2f} of one viewer's {row['one_percent']:.1f} %; relay {row['relay_percent']:.1f} %, "
        f"broker {row['broker_percent']:.1f} %; frames every {row['gap_p50_ms'][2]:.1f} ms",
        flush=True,
    )
    return row


def measure_all(counts, folder):
    scene = Path("config/prostate.toml").read_text()
    for key, value in {
        "kind": '"scripted"',
        "trajectory": f'"{Path("config/insertion.csv").resolve()}"',
        "loop": "true",
        "max_clients": "1024",
        "max_clients_per_address": "1024",
    }.items():
        scene, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", scene, count=1)
        assert count == 1, key
    (folder / "scene.toml").write_text(scene)
    url = f"nats://127.0.0.1:{free_port()}"
    nats = shutil.which("nats-server", path=os.environ["PATH"] + ":/usr/sbin")
    with running([nats, "-a", "127.0.0.1", "-p", url.rsplit(":", 1)[1]], stderr=subprocess.DEVNULL) as broker:
        return [measure(folder / "scene.toml", url, broker, viewers) for viewers in counts]


def table(rows):
    lines = [
        "| viewers | daemon, % of a core: beside it | behind the relay | one viewer beside it | ratio | "
        "relay, % | broker, % |",
        "|" + "---|" * 7,
    ]
    for r in rows:
        lines.append(
            f"| {r['viewers']} | {r['direct_percent']:.1f} | {r['behind_percent']:.1f} | {r['one_percent']:.1f} | "
            f"{r['ratio']:.2f} | {r['relay_percent']:.1f} | {r['broker_percent']:.1f} |"
        )
    lines += [
        "",
        "Default scene, the needle of config/insertion.csv moving; viewers of the surface, 30 Hz. The three "
        "daemons of a row run "
        "at the same time on one core, broker, relay and viewers on the other; processor time from "
        "/proc/PID/stat, the mean of "
        f"{TIMES} times {SECONDS} s with programs restarted.",
    ]
    return "\n".join(lines) + "\n"


def draw(rows, folder):
    figure, axes = plt.subplots(figsize=(6.4, 4))
    viewers = [r["viewers"] for r in rows]
    one = [r["one_percent"] for r in rows]
    axes.plot(viewers, [r["direct_percent"] for r in rows], "o-", color="tab:blue", label="beside the daemon")
    axes.plot(viewers, [r["behind_percent"] for r in rows], "o-", color="tab:orange", label="behind the relay")
    axes.fill_between(
        viewers,
        [o / SHARE for o in one],
        [o * SHARE for o in one],
        color="tab:gray",
        alpha=0.25,
        linewidth=0,
        label="one viewer beside it, ± 10 %",
    )
    axes.set(
        xscale="log",
        xlabel="viewers of the surface",
        ylabel="the daemon's processor time, % of a core",
        ylim=(0, None),
    )
    axes.set_xticks(viewers, [str(v) for v in viewers])
    axes.minorticks_off()
    axes.legend()
    figure.tight_layout()
    figure.savefig(folder / "relay_load.svg", metadata={"Date": None})


def main():
    kept, charts, quick = Path(sys.argv[1]), Path(sys.argv[2]), "--quick" in sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        rows = measure_all([1, 50] if quick else VIEWER_COUNTS, Path(folder))
    worst = max(r["ratio"] for r in rows)
    kept.write_text(json.dumps({"rows": rows, "worst_share": worst, "largest_share": SHARE}, indent=1) + "\n")
    (charts / "relay_load.md").write_text(table(rows))
    draw(rows, charts)
    print(
        f"relay_load: behind the relay the daemon takes at most {worst:.2f} of what one viewer beside it costs; "
        f"table and chart in {charts}, figures in {kept}"
    )
    return 0 if worst <= SHARE else 1


sys.exit(main())
