"""Judges what latency.sh measured: latency.py REPLAY_JSON SUMMARY_JSON CYCLICTEST_HISTOGRAM. Exit code 1: a figure
is missed."""
import json
import sys

TICK_MS, SNAPSHOT_MS = 5, 1000 / 30  # of the default scene
PERIOD_US = 5000


def cyclictest(path):
    """p99 in ms, and the share of wake-ups after the next deadline, of all its threads together."""
    counts = {}
    overflows = 0
    with open(path) as lines:
        for line in lines:
            if line.startswith("# Histogram Overflows:"):
                overflows = sum(int(count) for count in line.split(":")[1].split())
            elif not line.startswith("#") and line.strip():
                late_us, *of_threads = line.split()
                counts[int(late_us)] = sum(int(count) for count in of_threads)
    cycles = sum(counts.values()) + overflows
    seen = 0
    for late_us in sorted(counts):
        seen += counts[late_us]
        if seen >= 0.99 * cycles:
            break
    missed = overflows + sum(count for late_us, count in counts.items() if late_us > PERIOD_US)
    return late_us / 1000, missed / cycles


def main():
    replay, summary = (json.load(open(path)) for path in sys.argv[1:3])
    p99_ms, missed = cyclictest(sys.argv[3])
    vertices = replay["pose_to_vertices_ms"]
    rows = [("pose to vertices, p50, ms", vertices["p50"], TICK_MS + SNAPSHOT_MS),
            ("pose to vertices, p99, ms", vertices["p99"], 60),
            ("wake-up under load, p99, ms", summary["lateness_ms"]["p99"], 1.5 * p99_ms),
            ("missed under load, %", 100 * summary["overruns"] / summary["ticks"], 150 * missed)]
    for name, figure, limit in rows:
        print(f"latency: {name:<28} {figure:8.3f}   at most {limit:8.3f}   {'ok' if figure <= limit else 'MISSED'}")
    print(f"latency: of cyclictest: wake-up p99 {p99_ms:.3f} ms, missed {100 * missed:.3f} %; {summary['realtime']}")
    return 0 if all(figure <= limit for _, figure, limit in rows) else 1


sys.exit(main())
