#!/usr/bin/env python3
"""Draws the charts of scripts/charts/stability.sh.   stability_charts.py STABILITY.json DIR"""
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import kernel_list
import matplotlib.pyplot as plt

# As scripts/charts/compare_charts.py has them.
KERNELS = tuple(kernel_list.kernels())
METHODS = {
    **{name: (*shown, "-") for name, shown in kernel_list.colored_kernels().items()},
    "phi": ("Φ", "black", ":"),
    "compact_elastic": ("compact elastic", "black", "--"),
    "elastic": ("elastic", "black", "-"),
    "fem": ("fem", "tab:cyan", "--"),
    "thin_plate": ("thin-plate", "tab:purple", "-"),
    "multiquadric": ("multiquadric", "tab:purple", "--"),
    "mass_spring": ("mass-spring", "tab:brown", "-"),
    "chainmail": ("ChainMail", "tab:pink", "-"),
}
plt.style.use(Path(__file__).with_name("brachyd.mplstyle"))


def chosen(curves, sweep, methods=METHODS):
    """The curves of one sweep, in the order of METHODS."""
    found = {curve["method"]: curve for curve in curves if curve["sweep"] == sweep}
    return [(METHODS[name], found[name]) for name in METHODS if name in found and name in methods]


def legend_below(figure, panels, bottom, columns):
    """One legend for all panels, each name once."""
    names = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels()):
            names.setdefault(name, handle)
    figure.legend(names.values(), names.keys(), loc="lower center", ncol=columns, fontsize=8)
    figure.tight_layout(rect=(0, bottom, 1, 1))


def draw_condition(curves, path):
    figure, panels = plt.subplots(1, 3, figsize=(11, 4.4))
    shaft, needle, ratio = panels
    for (name, color, style), curve in chosen(curves, "landmark spacing, shaft of 24"):
        shaft.plot(curve["at"], curve["condition"], color=color, linestyle=style, label=name)
        shaft.plot(
            curve["at"],
            curve["condition_by_theory"],
            color=color,
            linewidth=0.8,
            linestyle=":",
            label="by the law of the least eigenvalue" if name == "ψ3,1" else None,
        )
    shaft.set(
        xscale="log",
        yscale="log",
        xlim=(4, 2e4),
        ylim=(1, 1e16),
        xlabel="support over spacing, a/q",
        ylabel="condition number",
        title="24 landmarks on a line",
    )
    for sweep in ("landmark spacing, shaft of 9", "landmark spacing, shaft of 9, walls held"):
        for (name, color, style), curve in chosen(curves, sweep):
            needle.plot(curve["at"], curve["condition"], color=color, linestyle=style, label=name)
    for (name, color, _), curve in chosen(curves, "landmark spacing, line of 9 points with cores"):
        needle.plot(
            [2.5 * at for at in curve["at"]],
            curve["condition"],
            color=color,
            linestyle="-.",
            label="elastic, points of core 2.5 mm",
        )
    needle.set(
        xscale="log",
        yscale="log",
        xlim=(5, 1e-2),
        ylim=(1, 1e16),
        xlabel="spacing, mm",
        title="needle of 9, the default scene",
    )
    for (name, color, style), curve in chosen(curves, "support ratio, three landmarks in a line, the paper's rule"):
        ratio.plot(curve["at"], curve["condition"], color=color, linestyle=style, label=name)
    ratio.set(
        xscale="log",
        yscale="log",
        xlabel="middle support over the outer ones'",
        ylim=(1, 1e16),
        title="three landmarks, the paper's rule",
    )
    ratio.set_xticks([1, 2, 3, 5, 10], ["1", "2", "3", "5", "10"])
    ratio.minorticks_off()
    for axes in (shaft, needle):
        axes.axhline(1e12, color="black", linewidth=0.8, linestyle="--")
    shaft.annotate("10¹²: singular", (4.5, 1e12), xytext=(0, 3), textcoords="offset points", fontsize=8)
    legend_below(figure, panels, 0.14, 6)
    figure.savefig(path, metadata={"Date": None})


def draw_min_det(curves, rows, path):
    figure, panels = plt.subplots(1, 3, figsize=(11, 4.4), sharey=True)
    one, contact, shaft = panels
    for (name, color, style), curve in chosen(curves, "push, one landmark", KERNELS + ("phi",)):
        one.plot(curve["at"], curve["min_det"], color=color, linestyle=style, label=name)
    for row in rows:
        if row["sweep"] == "push, one landmark" and row["theory"] is not None:
            one.plot(
                row["theory"],
                0,
                color=METHODS[row["method"]][1],
                marker="|",
                markersize=14,
                label="fold by theory" if row["method"] == "psi31" else None,
                linestyle="",
            )
    one.set(xlabel="push over support, |d|/a", ylabel="least det(I + ∇u)", title="one landmark", xlim=(0, 0.75))
    others = [name for name in METHODS if name not in KERNELS and name != "phi"]
    for (name, color, style), curve in chosen(curves, "push, one landmark", others):
        contact.plot(curve["at"][1:], curve["min_det"][1:], color=color, linestyle=style, label=name)
    contact.set(xscale="log", xlabel="push, mm", title="one landmark, the default scene", xlim=(0.1, 40))
    for (name, color, style), curve in chosen(curves, "push, shaft, across"):
        shaft.plot(curve["at"][1:], curve["min_det"][1:], color=color, linestyle=style, label=name)
    shaft.set(xscale="log", xlabel="push, mm", title="shaft of five pushed across, the default scene", xlim=(0.1, 40))
    for axes in panels:
        axes.axhline(0, color="black", linewidth=0.8, linestyle="--")
        axes.set_ylim(-1, 1.05)
    for axes in (contact, shaft):
        axes.set_xticks([0.1, 1, 10, 40], ["0.1", "1", "10", "40"])
        axes.minorticks_off()
    one.annotate("folded", (0.02, 0), xytext=(0, -11), textcoords="offset points", fontsize=8)
    legend_below(figure, panels, 0.14, 7)
    figure.savefig(path, metadata={"Date": None})


def draw_plane(plane, path):
    figure, panels = plt.subplots(1, len(KERNELS), figsize=(2.75 * len(KERNELS), 3.8), sharey=True)
    for axes, kernel in zip(panels, KERNELS):
        name, color, _ = METHODS[kernel]
        borders = [border for border in plane if border["method"] == kernel]
        for border in borders:
            if border.get("load") == "whole shaft":
                axes.plot(border["spacing"], border["push"], color=color)
                axes.fill_between(border["spacing"], border["push"], 10, color=color, alpha=0.25, linewidth=0)
            elif border.get("load") == "tip alone":
                axes.plot(border["spacing"], border["push"], color=color, linestyle="--")
                axes.fill_between(border["spacing"], border["push"], 10, color=color, alpha=0.12, linewidth=0)
            elif border["kind"] == "singular":
                axes.axvline(border["spacing"][0], color="black")
            else:
                axes.axvline(border["spacing"][0], color="black", linewidth=0.8, linestyle=":")
        axes.set(
            xscale="log", yscale="log", xlim=(3e-3, 1), ylim=(4e-3, 2), xlabel="spacing over support", title=name
        )
        axes.set_xticks([0.01, 0.03, 0.1, 0.3, 1], ["0.01", "0.03", "0.1", "0.3", "1"])
        axes.minorticks_off()
    panels[0].set_yticks([0.01, 0.03, 0.1, 0.3, 1], ["0.01", "0.03", "0.1", "0.3", "1"])
    panels[0].set_ylabel("push over support")
    styles = (
        ("the shaft as a whole folds", {"color": "gray"}),
        ("its tip alone folds", {"color": "gray", "linestyle": "--"}),
        ("condition 10¹²", {"color": "black"}),
        ("single precision misses landmarks by 1e-3 mm", {"color": "black", "linewidth": 0.8, "linestyle": ":"}),
    )
    figure.legend(
        [matplotlib.lines.Line2D([], [], **style) for _, style in styles],
        [name for name, _ in styles],
        loc="lower center",
        ncol=4,
        fontsize=8,
    )
    figure.tight_layout(rect=(0, 0.1, 1, 1))
    figure.savefig(path, metadata={"Date": None})


def main():
    report, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    draw_condition(report["curves"], folder / "condition.svg")
    draw_min_det(report["curves"], report["rows"], folder / "least_det.svg")
    draw_plane(report["plane"], folder / "failure_plane.svg")


main()
