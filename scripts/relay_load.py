"""Measures and draws for scripts/relay_load.sh.   relay_load.py JSON DIR [--quick]"""
import contextlib
import json
import os
import re
import shutil
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
AUDIENCES = [1, 10, 50, 200]
SECONDS = 15  # the needle's whole way, which it goes over and over
SHARE = 1.10  # of what one viewer beside the daemon costs
NAMES = {"direct": ("beside the daemon", "tab:blue"), "relay": ("behind the relay", "tab:orange")}
plt.rcParams.update({"svg.hashsalt": "brachyd", "svg.fonttype": "none", "font.family": "sans-serif",
                     "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial"], "axes.spines.top": False,
                     "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.3, "font.size": 9,
                     "legend.frameon": False})


def processor_s(process):
    """User and system time of a process since its start."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


@contextlib.contextmanager
def running(command, **options):
    process = subprocess.Popen([str(part) for part in command], text=True, **options)
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


def measure(port, viewers, processes):
    """Shares of a core that `processes` take while so many viewers of the surface watch at `port`."""
    command = [BIN / "brachy_crowd", "--port", port, "--viewers", viewers, "--surface", "--seconds", SECONDS + 2]
    with running(command, stdout=subprocess.PIPE) as crowd:
        if crowd.stdout.readline() != "ready\n":
            raise SystemExit("relay_load: the crowd did not come")
        time.sleep(1)
        begin, before = time.monotonic(), [processor_s(p) for p in processes]
        time.sleep(SECONDS)
        passed, after = time.monotonic() - begin, [processor_s(p) for p in processes]
        seen = json.loads(crowd.stdout.readline())
    if seen["served"] != viewers:
        raise SystemExit(f"relay_load: {seen['served']} of {viewers} viewers were served: {seen['closed']}")
    return [(b - a) / passed for a, b in zip(before, after)], seen


def row(way, viewers, shares, seen):
    row = {"way": way, "viewers": viewers, "daemon_percent": 100 * shares[0],
           "frames_hz": seen["frames"] / viewers / (SECONDS + 2), "gap_p99_ms": seen["gap_ms"]["p99"]}
    if len(shares) > 1:
        row["relay_percent"], row["broker_percent"] = 100 * shares[1], 100 * shares[2]
    print(f"{NAMES[way][0]:18} {viewers:4} viewers: daemon {row['daemon_percent']:5.1f} % of a core, "
          f"{row['frames_hz']:.1f} frames a second" +
          (f"; relay {row['relay_percent']:.1f} %, broker {row['broker_percent']:.1f} %" if len(shares) > 1 else ""),
          flush=True)
    return row


def measure_all(audiences, folder):
    scene = Path("config/prostate.toml").read_text()
    for key, value in {"kind": '"scripted"', "trajectory": f'"{Path("config/insertion.csv").resolve()}"', "loop": "true",
                       "max_clients": "1024", "max_clients_per_address": "1024"}.items():
        scene, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", scene, count=1)
        assert count == 1, key
    (folder / "scene.toml").write_text(scene)
    daemon = [BIN / "brachyd", "--config", folder / "scene.toml", "--port", 0]
    url = f"nats://127.0.0.1:{free_port()}"
    nats = shutil.which("nats-server", path=os.environ["PATH"] + ":/usr/sbin")
    rows = []
    with contextlib.ExitStack() as stack:
        def start(command, **options):
            return stack.enter_context(running(command, stderr=subprocess.DEVNULL, **options))
        broker = start([nats, "-a", "127.0.0.1", "-p", url.rsplit(":", 1)[1]])
        # Never both at once: each daemon has what the machine has.
        for viewers in audiences:
            with running(daemon, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as direct:
                shares, seen = measure(port_of(direct, "brachyd"), viewers, [direct])
                rows.append(row("direct", viewers, shares, seen))
            with running([*daemon, "--nats", url], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as published, \
                    running([BIN / "brachy", "relay", "--nats", url, "--port", 0], stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL) as relay:
                port_of(published, "brachyd")
                shares, seen = measure(port_of(relay, "brachy relay"), viewers, [published, relay, broker])
                rows.append(row("relay", viewers, shares, seen))
    return rows


def table(rows, one):
    lines = ["| viewers | daemon, % of a core: beside it | behind the relay | of one viewer's beside it | relay, % | broker, % |",
             "|" + "---|" * 6]
    for direct in (r for r in rows if r["way"] == "direct"):
        relay = next(r for r in rows if r["way"] == "relay" and r["viewers"] == direct["viewers"])
        lines.append(f"| {direct['viewers']} | {direct['daemon_percent']:.1f} | {relay['daemon_percent']:.1f} | "
                     f"{relay['daemon_percent'] / one:.2f} | {relay['relay_percent']:.1f} | {relay['broker_percent']:.1f} |")
    lines += ["", f"Default scene, the needle of config/insertion.csv moving; viewers of the surface, 30 Hz; daemon, broker, relay "
              f"and viewers on one machine of {os.cpu_count()} cores; processor time over {SECONDS} s each, from /proc/PID/stat."]
    return "\n".join(lines) + "\n"


def draw(rows, one, folder):
    figure, axes = plt.subplots(figsize=(6.4, 4))
    for way, (name, color) in NAMES.items():
        at = [r for r in rows if r["way"] == way]
        axes.plot([r["viewers"] for r in at], [r["daemon_percent"] for r in at], "o-", color=color, label=name)
    axes.axhspan(one / SHARE, one * SHARE, color="tab:gray", alpha=0.25, linewidth=0, label="one viewer's ± 10 %")
    viewers = sorted({r["viewers"] for r in rows})
    axes.set(xscale="log", xlabel="viewers of the surface", ylabel="the daemon's processor time, % of a core", ylim=(0, None))
    axes.set_xticks(viewers, [str(v) for v in viewers])
    axes.minorticks_off()
    axes.legend()
    figure.tight_layout()
    figure.savefig(folder / "relay_load.svg", metadata={"Date": None})


def main():
    kept, charts, quick = Path(sys.argv[1]), Path(sys.argv[2]), "--quick" in sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        rows = measure_all([1, 50] if quick else AUDIENCES, Path(folder))
    one = next(r["daemon_percent"] for r in rows if r["way"] == "direct" and r["viewers"] == 1)
    worst = max(r["daemon_percent"] for r in rows if r["way"] == "relay") / one
    kept.write_text(json.dumps({"rows": rows, "worst_share": worst, "largest_share": SHARE}, indent=1) + "\n")
    (charts / "relay_load.md").write_text(table(rows, one))
    draw(rows, one, charts)
    print(f"relay_load: behind the relay the daemon takes at most {worst:.2f} of what one viewer beside it costs; "
          f"table and chart in {charts}, figures in {kept}")
    return 0 if worst <= SHARE else 1


sys.exit(main())
