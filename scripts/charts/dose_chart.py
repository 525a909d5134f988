#!/usr/bin/env python3
"""Writes the table and draws the chart of scripts/charts/dose.sh.   dose_chart.py BENCH.json DIR"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ERRORS = {"v100_error_percent": ("V100", "tab:blue"), "d90_error_percent": ("D90", "tab:orange"),
          "mean_error_percent": ("dose at a random point, mean", "tab:green")}
plt.style.use(Path(__file__).with_name("brachyd.mplstyle"))


def table(bench, rows, seed, evaluate):
    lines = ["| spacing, mm | points | a seed, ms | exact loop, ms | DVHs, ms | V100 % | off, % | D90 Gy | off, % "
             "| a point's dose off, mean % |", "|" + "---|" * 10]
    for r in rows:
        lines.append(f"| {r['spacing_mm']:g} | {r['points']:,} | {r['ms']:.3g} | {r['baseline_ms']:.3g} | "
                     f"{r['evaluate_ms']:.2g} | {r['v100_percent']:.2f} | {r['v100_error_percent']:+.2f} | "
                     f"{r['d90_gy']:.1f} | {r['d90_error_percent']:+.2f} | {r['mean_error_percent']:.2f} |")
    lines += ["", f"100 seeds of 0.4 U at random in the default phantom, 145 Gy; one thread of {bench['machine']}, "
              f"simd {bench['simd']}. Off: against exact sums at random points of the gland, "
              "whose own error is some 0.1 %."]
    for r in seed:
        lines.append(f"\nA seed on {r['points']:,} points, 1 mm: {r['ms']:.2f} ms, the exact sum's loop "
                     f"{r['baseline_ms']:.1f} ms, {r['ratio']:.0f} times; of 100 seeds no point is further off than "
                     f"{r['largest_error_percent']:.1g} %.")
    for r in evaluate:
        lines.append(f"\nAll figures of {r['structures']:g} structures at 1 mm: {r['ms']:.2f} ms, by sorting "
                     f"{r['baseline_ms']:.1f} ms.")
    return "\n".join(lines) + "\n"


def main():
    bench, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    rows, seed, evaluate = ([r for r in bench["rows"] if r["case"] == case]
                            for case in ("dose/spacing", "dose/seed", "dose/evaluate"))
    rows.sort(key=lambda r: r["spacing_mm"])
    text = table(bench, rows, seed, evaluate)
    (folder / "dose.md").write_text(text)
    print(text)

    figure, (time, error) = plt.subplots(1, 2, figsize=(10, 4.2))
    spacings = [r["spacing_mm"] for r in rows]
    time.plot(spacings, [r["baseline_ms"] for r in rows], "s-", color="tab:gray", label="exact sum's loop, a seed")
    time.plot(spacings, [r["ms"] for r in rows], "o-", color="tab:blue", label="grid, a seed")
    time.plot(spacings, [r["evaluate_ms"] for r in rows], "x--", color="tab:red", label="all structures' DVH")
    time.set(xscale="log", yscale="log", xlabel="grid's spacing, mm", ylabel="ms, one thread")
    time.set_xticks(spacings, [f"{s:g}" for s in spacings])
    time.minorticks_off()
    for key, (label, color) in ERRORS.items():
        error.plot([r["ms"] for r in rows], [abs(r[key]) for r in rows], "o-", color=color, label=label)
    for r in rows:
        error.annotate(f"{r['spacing_mm']:g} mm", (r["ms"], r["mean_error_percent"]), xytext=(3, 4),
                       textcoords="offset points", fontsize=7, color="gray")
    error.axhline(1, color="gray", linewidth=0.8, linestyle=":")
    error.set(xscale="log", yscale="log", xlabel="ms a seed, one thread", ylabel="off the exact sum, %")
    for axes in (time, error):
        axes.legend(fontsize=8)
    figure.suptitle("dose of 100 I-125 seeds in the phantom: the grid's spacing against time and error", fontsize=9)
    figure.tight_layout()
    figure.savefig(folder / "dose.svg", metadata={"Date": None})


main()
