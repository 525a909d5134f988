#!/usr/bin/env python3
"""The second table of scripts/charts/lag.sh: ticks and deadlines of a running daemon, by scenario.

usage: scripts/charts/lag_table.py FOLDER     with lag.json and SCENARIO.daemon.json, brachyd's closing summaries
"""
import json
import pathlib
import sys


def share(missed, ticks):
    return f"{100 * missed / max(1, ticks + missed):.2f}"


def main():
    folder = pathlib.Path(sys.argv[1])
    print("\nA running daemon, its hands in a loop, beside an idle thread with the same deadlines:\n")
    print("| needles | tick, ms: p50 | p99 | deadlines missed, % | by the control thread, % | ticks late | told, mm |")
    print("|---|---|---|---|---|---|---|")
    for row in json.loads((folder / "lag.json").read_text(encoding="utf-8")):
        daemon = json.loads((folder / f"{row['scenario']}.daemon.json").read_text(encoding="utf-8"))
        tick = daemon["tick_ms"]
        print(f"| {row['scenario']} | {tick['p50']:.2f} | {tick['p99']:.2f} | "
              f"{share(daemon['overruns'], daemon['ticks'])} | "
              f"{share(daemon['control_overruns'], daemon['control_ticks'])} | "
              f"{daemon['ticks_late']} of {daemon['ticks']} | {daemon['max_lag_mm']:.3f} |")


if __name__ == "__main__":
    main()
