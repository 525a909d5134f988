#!/usr/bin/env python3
"""Draws the chart of scripts/charts/zwidth.sh.   zwidth_chart.py ZWIDTH.json DIR"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

COLORS = {200: "tab:blue", 500: "tab:green", 1000: "tab:orange", 2000: "tab:red"}
plt.style.use(Path(__file__).with_name("brachyd.mplstyle"))


def draw_local(axes, points):
    for rate in sorted({p["rate_hz"] for p in points}):
        at = [p for p in points if p["rate_hz"] == rate]
        delays = [p["added_delay_ms"] for p in at]
        axes.plot(delays, [1e3 * p["limit_n_per_mm"] for p in at], color=COLORS.get(rate, "gray"), linewidth=1)
        axes.plot(delays, [1e3 * p["stable_n_per_mm"] for p in at], "o", markersize=4, color=COLORS.get(rate, "gray"),
                  label=f"{rate:g} Hz")
    axes.set(title="local model: the device works out its force", xlabel="network's delay there and back, ms",
             ylabel="largest stable stiffness, N/m")


def draw_wire(axes, points, damping):
    held = sorted({p["held_ms"] for p in points})
    tau = np.linspace(0.4, 60, 300)
    for t in held:
        rates = [p["rate_hz"] for p in points if p["held_ms"] == t]
        axes.plot(tau, 1e3 * 2 * damping / (1e-3 * (t + 2 * tau)), color=COLORS.get(min(rates), "gray"), linewidth=1)
    for rate in sorted({p["rate_hz"] for p in points}):
        at = [p for p in points if p["rate_hz"] == rate]
        axes.plot([p["loop_delay_ms"] for p in at], [1e3 * p["stable_n_per_mm"] for p in at], "o", markersize=4,
                  color=COLORS.get(rate, "gray"), label=f"{rate:g} Hz")
    axes.set(title="wire: the daemon does", xlabel="loop's delay τ from pose to force, ms", xscale="log")
    axes.set_xticks([0.5, 1, 2, 5, 10, 20, 50], ["0.5", "1", "2", "5", "10", "20", "50"])
    axes.minorticks_off()


def main():
    report, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    figure, (local, wire) = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True)
    draw_local(local, [p for p in report["points"] if p["loop"] == "local"])
    draw_wire(wire, [p for p in report["points"] if p["loop"] == "wire"], report["damping_n_s_per_mm"])
    for axes in (local, wire):
        axes.set(yscale="log", ylim=(5, 5000))
        axes.set_yticks([10, 30, 100, 300, 1000, 3000], ["10", "30", "100", "300", "1000", "3000"])
        axes.minorticks_off()
    handles, names = local.get_legend_handles_labels()
    line = matplotlib.lines.Line2D([], [], color="gray", linewidth=1)
    figure.legend([*handles, line], [*names, "negotiated: 2b/(T + 2τ)"], loc="lower center", ncol=5, fontsize=8)
    figure.suptitle(f"free mass of {1e3 * report['mass_kg']:g} g, b = {1e3 * report['damping_n_s_per_mm']:g} N·s/m: "
                    "it rings above the points", fontsize=9)
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.savefig(folder / "zwidth.svg", metadata={"Date": None})


main()
