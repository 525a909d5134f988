#!/usr/bin/env python3
"""Draws the charts of scripts/charts/compare.sh.   compare_charts.py COMPARE.json DIR"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import kernel_list
import matplotlib.pyplot as plt
from chart_labels import NAMES, label

KERNELS = kernel_list.colored_kernels()
FAMILIES = {
    "matrix": ("matrix-valued kernels", "black", "*", 90),
    "spline": ("splines without bounds", "tab:purple", "s", 30),
    "springs": ("mass-spring", "tab:brown", "D", 28),
    "exact": ("the same, columns kept", "black", "+", 50),
    "chainmail": ("ChainMail", "tab:pink", "^", 36),
    "paper": ("the paper's way", "tab:gray", "X", 44),
}
plt.style.use(Path(__file__).with_name("brachyd.mplstyle"))


def mean(values):
    values = list(values)
    return sum(values) / len(values)


def means_of(rows):
    """One record a model that has an answer for every scene: means over the scenes that count."""
    rows = [row for row in rows if row["counts"]]
    scenes = {row["scene"] for row in rows}
    models = {}
    for row in rows:
        if "error" not in row:
            models.setdefault(row["model"], []).append(row)
    for row in rows:  # where the landmarks cannot move, a tip that advances takes a set-up
        if "error" not in row:
            row.setdefault("advance_ms", row["setup_ms"])
    keys = ("rel_l2", "tick_ms", "advance_ms", "setup_ms")
    return [
        {**of[0], "scenes": len(of), **{key: mean(row[key] for row in of) for key in keys}}
        for of in models.values()
        if {row["scene"] for row in of} == scenes
    ]


def name_of(row):
    if row["family"] == "psi":
        return f"{KERNELS[row['kernel']][0]}, a = {row['support_mm']:g}" + (" + anchors" if row["anchors"] else "")
    return NAMES.get(row["model"], row["model"])


def front_of(models, x):
    """Those that none is both faster and better than."""
    front = []
    for row in sorted(models, key=lambda row: (row[x], row["rel_l2"])):
        if not front or row["rel_l2"] < front[-1]["rel_l2"]:
            front.append(row)
    return front


def draw_against(models, x, xlabel, title, path, budgets=(), whisker=None):
    figure, axes = plt.subplots(figsize=(9, 6))
    for kernel, (name, color) in KERNELS.items():
        for anchors in (False, True):
            rows = [
                row
                for row in models
                if row["family"] == "psi" and row["kernel"] == kernel and row["anchors"] == anchors
            ]
            if rows:
                axes.scatter(
                    [row[x] for row in rows],
                    [row["rel_l2"] for row in rows],
                    s=14,
                    alpha=0.8,
                    color=color,
                    facecolor="none" if anchors else color,
                    label=f"{name}, a = {min(row['support_mm'] for row in rows):g}–"
                    f"{max(row['support_mm'] for row in rows):g} mm" + (", 8 anchors" if anchors else ""),
                )
    for family, (name, color, marker, size) in FAMILIES.items():
        rows = [row for row in models if row["family"] == family]
        if rows:
            axes.scatter(
                [row[x] for row in rows],
                [row["rel_l2"] for row in rows],
                s=size,
                color=color,
                marker=marker,
                label=name,
                zorder=3,
            )
    front = front_of(models, x)
    if whisker:
        for i, row in enumerate(row for row in models if row["family"] != "psi" or row in front):
            axes.plot(
                [row[x], row[whisker]],
                [row["rel_l2"]] * 2,
                color="gray",
                linewidth=0.7,
                marker="|",
                markevery=[1],
                markersize=6,
                zorder=2,
                label="to |: while the tip advances" if i == 0 else None,
            )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=xlabel,
        title=title,
        ylabel=f"relative L2 error in the gland, mean over {models[0]['scenes']} scenes",
    )
    most = max([row[key] for row in models for key in (x, whisker) if key] + [b for b, _ in budgets])
    axes.set_xlim(min(row[x] for row in models) / 2, most * 3)
    axes.set_ylim(min(row["rel_l2"] for row in models) / 1.5, max(row["rel_l2"] for row in models) * 1.5)
    ticks = [t for t in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5) if axes.get_ylim()[0] <= t <= axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"{100 * t:g} %" for t in ticks])
    axes.minorticks_off()
    axes.step(
        [row[x] for row in front] + [axes.get_xlim()[1]],
        [row["rel_l2"] for row in front] + [front[-1]["rel_l2"]],
        where="post",
        color="black",
        linewidth=0.8,
        zorder=1,
        label="Pareto front",
    )
    for budget, name in budgets:
        axes.axvline(budget, color="black", linewidth=0.8, linestyle=":")
        axes.annotate(
            name,
            (budget, axes.get_ylim()[1]),
            xytext=(-3, -4),
            textcoords="offset points",
            rotation=90,
            ha="right",
            va="top",
            fontsize=8,
        )
    figure.legend(loc="lower center", ncol=4, fontsize=8)
    figure.tight_layout(rect=(0, 0.15, 1, 1))
    figure.canvas.draw()
    psi = [row for row in front if row["family"] == "psi"]
    named = [row for row in front if row not in psi] + psi[:1]
    for row in psi[1:]:  # those worth a name: a tenth better than the last one named
        if row["rel_l2"] < 0.9 * min(other["rel_l2"] for other in named if other["family"] == "psi"):
            named.append(row)
    named += [row for row in models if row["family"] != "psi" and row not in front]
    label(
        figure,
        axes,
        [(row[x], row["rel_l2"], name_of(row), "bold" if row in front else "normal") for row in named],
        [(row[x], row["rel_l2"]) for row in models],
    )
    figure.savefig(path, metadata={"Date": None})


def draw_supports(rows, path):
    figure, panels = plt.subplots(1, 3, figsize=(11, 4.2), sharey=True)
    for axes, (group, title) in zip(
        panels,
        (
            ("homogeneous", "one tissue, held all round"),
            ("stiff", "gland three times stiffer"),
            ("free_face", "free face"),
        ),
    ):
        for kernel, (name, color) in KERNELS.items():
            for anchors in (False, True):
                of = [
                    row
                    for row in rows
                    if row["family"] == "psi"
                    and row["kernel"] == kernel
                    and row["group"] == group
                    and row["anchors"] == anchors
                    and "error" not in row
                ]
                supports = sorted({row["support_mm"] for row in of})
                axes.plot(
                    supports,
                    [mean(row["rel_l2"] for row in of if row["support_mm"] == a) for a in supports],
                    color=color,
                    marker=".",
                    linestyle="--" if anchors else "-",
                    linewidth=1,
                    label=name + (", 8 anchors" if anchors else ""),
                )
        axes.axhline(1, color="black", linewidth=0.8, linestyle=":")
        axes.set(xscale="log", yscale="log", xlabel="support radius a, mm", title=title)
        axes.set_xticks([6, 12, 24, 48, 96], ["6", "12", "24", "48", "96"])
        axes.minorticks_off()
    ticks = [t for t in (0.2, 0.5, 1, 2, 5) if panels[0].get_ylim()[0] <= t <= panels[0].get_ylim()[1]]
    panels[0].set_yticks(ticks, [f"{100 * t:g} %" for t in ticks])
    panels[0].annotate(
        "no better than not moving at all", (6, 1), xytext=(0, 3), textcoords="offset points", fontsize=8
    )
    panels[0].set_ylabel("relative L2 error in the gland")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="lower center", ncol=4)
    figure.tight_layout(rect=(0, 0.12, 1, 1))
    figure.savefig(path, metadata={"Date": None})


def main():
    rows, folder = json.loads(Path(sys.argv[1]).read_text())["rows"], Path(sys.argv[2])
    # Half the landmarks and a surface's points are in the table only.
    rows = [row for row in rows if not row.get("surface") and "_sparse" not in row["model"]]
    folder.mkdir(parents=True, exist_ok=True)
    models = means_of(rows)
    if not models:
        sys.exit(f"{sys.argv[1]}: no model has an answer for every scene; nothing to draw")
    draw_against(
        models,
        "tick_ms",
        "ms a tick: 14,560 points, one thread, the landmarks' displacements moving",
        "Time a tick against error",
        folder / "error_against_tick.svg",
        ((5, "5 ms: 200 Hz"), (1, "1 ms: 1 kHz")),
        "advance_ms",
    )
    draw_against(
        models,
        "setup_ms",
        "ms to set up, the first field included",
        "Set-up time against error",
        folder / "error_against_setup.svg",
    )
    if any(row["family"] == "psi" for row in rows):
        draw_supports(rows, folder / "error_against_support.svg")


main()
