#!/usr/bin/env python3
"""Draws the charts of scripts/bench.sh.   bench_charts.py BENCH.json DIR"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import kernel_list
import matplotlib.pyplot as plt

FLOPS_OF_PAIR, BYTES_OF_POINT = 22, 12
plt.rcParams.update({"svg.hashsalt": "brachyd", "axes.spines.top": False, "axes.spines.right": False,
                     "axes.grid": True, "grid.alpha": 0.3, "font.size": 9, "legend.frameon": False})


def select(rows, **wanted):
    return [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]


def line(axes, rows, x, y, label, **style):
    """Draws y (a field, or a function of a row) against the field x."""
    rows = sorted(rows, key=lambda row: row[x])
    value = y if callable(y) else lambda row: row[y]
    if rows:
        axes.plot([row[x] for row in rows], [value(row) for row in rows], label=label, **style)


def draw_ticks(bench, x, title, path, **wanted):
    """Ours, the paper's way and the machine's limits, against landmarks or points."""
    ticks = select(bench["rows"], case="tick", kernel="psi31", support_mm=12, **wanted)
    moving, fixed = select(ticks, moving=True, threads=1), select(ticks, moving=False, threads=1)
    limits = bench["limits"]

    def fma_ms(row):
        return FLOPS_OF_PAIR * row["pairs_inside"] / limits["fma_gflops"] * 1e-6

    def write_ms(row):
        rate = limits.get(f"write_gb_per_s_{row['points']}_points", limits["write_gb_per_s"])
        return BYTES_OF_POINT * row["points_inside"] / rate * 1e-6

    figure, axes = plt.subplots(figsize=(6.5, 4.5))
    line(axes, moving, x, "baseline_ms", "the paper's way", color="tab:gray", marker="s")
    line(axes, moving, x, "ms", "ours, all landmarks moving", color="tab:blue", marker="o")
    line(axes, fixed, x, "ms", "ours, landmarks fixed, 4 displaced", color="tab:green", marker="o")
    for series, color, kind in ((select(ticks, moving=True, threads=2), "tab:blue", "moving"),
                                (select(ticks, moving=False, threads=2), "tab:green", "fixed")):
        line(axes, series, x, "ms", f"{kind}, 2 threads", color=color, marker="x", linestyle="--")
    line(axes, moving, x, fma_ms, "limit: 22 flops a pair at the FMA peak", color="tab:red", linestyle=":")
    line(axes, moving, x, write_ms, "limit: writing the displacements", color="tab:purple", linestyle=":")
    axes.set(xscale="log", yscale="log", xlabel=x, ylabel="ms a tick, one thread unless said", title=title)
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.13), ncol=2)
    figure.savefig(path, bbox_inches="tight")


def draw_scaling(bench, path):
    figure, axes = plt.subplots(figsize=(6.5, 4.5))
    inside, outside = (select(bench["rows"], case=case) for case in ("inside", "outside"))
    line(axes, inside, "points_inside", "baseline_ms", "the paper's way", color="tab:gray", marker="s")
    line(axes, inside, "points_inside", "ms", "ours, all points inside supports", color="tab:blue", marker="o")
    line(axes, outside, "points", "ms", "ours, 10⁴ inside and the rest outside", color="tab:green", marker="o")
    axes.set(xscale="log", yscale="log", xlabel="points", ylabel="ms a rebuilt tick, one thread",
             title="Time against points inside and outside supports, ψ3,1, n = 10, a = 12 mm")
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.13), ncol=2)
    figure.savefig(path, bbox_inches="tight")


def draw_figure6(bench, path):
    """The paper's figure 6: dashed its solve, solid its evaluation of 14,560 displacements."""
    figure, grid = plt.subplots(2, 2, figsize=(10, 7.5), sharex=True, sharey=True)
    ways = (("the paper's way", "baseline_solve_ms", "baseline_evaluate_ms"), ("ours", "solve_ms", "evaluate_ms"))
    for panels, (way, solve, evaluate) in zip(grid, ways):
        for axes, threads in zip(panels, (1, 2)):
            for kernel, (label, color) in kernel_list.colored_kernels().items():
                rows = select(bench["rows"], case="figure6", kernel=kernel, threads=threads)
                line(axes, rows, "landmarks", evaluate, f"{label} evaluation", color=color, marker="o", markersize=3)
                line(axes, rows, "landmarks", solve, f"{label} solve", color=color, linestyle="--")
            axes.axhline(5, color="black", linewidth=0.8, linestyle=":")
            axes.annotate("200 a second", (100, 5), ha="right", va="bottom")
            axes.set(yscale="log", title=f"{way}, {threads} thread{'s' if threads > 1 else ''}")
    for axes in grid[:, 0]:
        axes.set_ylabel("ms")
    for axes in grid[1]:
        axes.set_xlabel("landmarks")
    figure.legend(*grid[0][0].get_legend_handles_labels(), loc="lower center", ncol=4)
    figure.suptitle(f"Figure 6 of the paper, redrawn: time for 14,560 displacements, a = 12 mm ({bench['machine']}, "
                    f"{bench['simd']})")
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.savefig(path)


def main():
    bench, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    draw_ticks(bench, "landmarks", "Time against landmarks, ψ3,1, a = 12 mm, 14,560 points",
               folder / "time_against_landmarks.svg", points=14560)
    draw_ticks(bench, "points", "Time against points, ψ3,1, a = 12 mm, 100 landmarks",
               folder / "time_against_points.svg", landmarks=100)
    draw_scaling(bench, folder / "time_against_points_inside.svg")
    draw_figure6(bench, folder / "figure6.svg")


main()
