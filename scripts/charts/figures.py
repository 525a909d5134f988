#!/usr/bin/env python3
"""Figures 1 to 5 of the paper, redrawn from our engine.   figures.py BRACHY DIR

Every displacement comes from `brachy deform`; this file places landmarks and draws. What the paper does not state is
chosen here: loads of 3 mm on a 40 mm square, and a push of 2.8 mm, the most at which none of its
fields folds at a = 6 mm.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import kernel_list
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

KERNELS = kernel_list.kernels()
plt.rcParams.update({"svg.hashsalt": "brachyd", "svg.fonttype": "none", "font.family": "sans-serif",
                     "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial"], "font.size": 9, "legend.frameon": False})


class Engine:
    def __init__(self, program, folder):
        self.program, self.folder = program, Path(folder)

    def run(self, *arguments):
        ended = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True)
        if ended.returncode:
            sys.exit(f"figures: {ended.stderr.strip()}")

    def write(self, name, header, rows):
        np.savetxt(self.folder / name, rows, delimiter=",", header=header, comments="", fmt="%.17g")
        return self.folder / name

    def deform(self, landmarks, displacements, points, kernel, support):
        """u at points (n×3) and det(I + ∇u)."""
        out = self.folder / "out.csv"
        self.run("deform", "--landmarks", self.write("L.csv", "x,y,z,dx,dy,dz", np.hstack([landmarks, displacements])),
                 "--points", self.write("P.csv", "x,y,z", points), "--kernel", kernel, "--support", support,
                 "--jacobian", "--out", out)
        rows = np.atleast_2d(np.loadtxt(out, delimiter=",", skiprows=1))
        return rows[:, 3:6], rows[:, 6]

    def phantom(self):
        """Vertices (n×3) and triangles (m×3) of the scene's gland."""
        ply = self.folder / "gland.ply"
        self.run("inspect", "config/prostate.toml", "--force", "--out", ply)
        head, body = ply.read_text().split("end_header\n")
        counts = [int(line.split()[2]) for line in head.splitlines() if line.startswith("element")]
        lines = body.splitlines()
        vertices = np.array([line.split()[:3] for line in lines[:counts[0]]], float)
        return vertices, np.array([line.split()[1:4] for line in lines[counts[0]:sum(counts)]], int)


def figure1(engine, folder):
    """One landmark displaced by 1 along x, looked at along y: u_x is ψ(r)."""
    r = np.linspace(0, 1, 201)
    figure, axes = plt.subplots(figsize=(5, 3.6))
    for kernel, name in KERNELS.items():
        u, _ = engine.deform([[0, 0, 0]], [[1, 0, 0]], np.outer(r, [0, 1, 0]), kernel, 1)
        axes.plot(r, u[:, 0], label=name)
    axes.set(xlabel="r", ylabel="ψ(r)", title="Figure 1: the kernels", xlim=(0, 1), ylim=(0, 1))
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(folder / "figure1.svg", metadata={"Date": None})


def square():
    """Grid lines of a 40 mm square, one point a millimetre (lines × points × 3)."""
    at, along = np.linspace(-20, 20, 21), np.linspace(-20, 20, 41)
    rows = np.array([[(x, y, 0) for x in along] for y in at])
    return np.concatenate([rows, rows[:, :, [1, 0, 2]]])


def figures_2_and_3(engine, folder):
    lines = square()
    loads = 20 * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    pushes = -3 / 20 * loads
    angle = 2 * np.pi * (np.arange(10) + 0.5) / 10
    anchors = 10 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    for number, held, title in ((2, anchors, "with ten anchors"), (3, np.empty((0, 3)), "without anchors")):
        figure, grid = plt.subplots(2, 2, figsize=(7, 7.4))
        cases = [(kernel, a) for kernel in ("psi30", "psi32") for a in (8, 40)]
        for axes, letter, (kernel, a) in zip(grid.flat, "abcd", cases):
            u, det = engine.deform(np.vstack([loads, held]), np.vstack(
                [pushes, 0 * held]), lines.reshape(-1, 3), kernel, a)
            moved = (lines.reshape(-1, 3) + u).reshape(lines.shape)
            axes.add_collection(LineCollection(moved[:, :, :2], colors="tab:blue", linewidths=0.6))
            axes.plot(*held[:, :2].T, "o", color="black", markersize=4, label="anchors")
            axes.quiver(*loads[:, :2].T, *pushes[:, :2].T, color="tab:red", angles="xy", scale_units="xy", scale=1,
                        width=0.008, zorder=3, label="loads of 3 mm")
            axes.set(xlim=(-23, 23), ylim=(-23, 23), aspect="equal", xticks=[], yticks=[],
                     title=f"({letter}) {KERNELS[kernel]}, a = {a}; least det {det.min():.2f}")
            axes.axis("off")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        used = [i for i, name in enumerate(labels) if name != "anchors" or len(held)]
        figure.legend([handles[i] for i in used], [labels[i] for i in used], loc="lower center", ncol=2)
        figure.suptitle(f"Figure {number}: a grid of 40 mm {title}")
        figure.tight_layout(rect=(0, 0.04, 1, 1))
        figure.savefig(folder / f"figure{number}.svg", metadata={"Date": None})


class Gland:
    """The phantom, pushed by a needle at its apex along +z, seen from below and the right."""
    PUSH = 2.8  # mm

    def __init__(self, engine):
        self.engine = engine
        self.vertices, self.triangles = engine.phantom()
        below = self.vertices[self.vertices[:, 2] < 0]
        self.contact = below[np.argmin((below[:, :2] ** 2).sum(axis=1))]
        centre = self.vertices.mean(axis=0)
        chosen = self.vertices[np.random.RandomState(1).choice(len(self.vertices), 8, replace=False)]
        self.anchors = centre + 0.5 * (chosen - centre)
        turn, tilt = np.radians(25), np.radians(50)
        about_z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        about_x = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
        # Screen: x right, z up, y away from the eye.
        self.view = about_x.T @ about_z

    def deformed(self, kernel, support, has_anchors):
        held = self.anchors if has_anchors else np.empty((0, 3))
        return self.engine.deform(np.vstack([self.contact, held]), np.vstack([[0, 0, self.PUSH], 0 * held]),
                                  self.vertices, kernel, support)[0]

    def draw(self, axes, u, wire):
        seen = (self.vertices + u) @ self.view.T
        corners = seen[self.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        order = [t for t in np.argsort(-corners[:, :, 1].mean(axis=1)) if normal[t, 1] < 0]
        size = np.linalg.norm(u[self.triangles].mean(axis=1), axis=1)[order]
        flat = corners[order][:, :, [0, 2]]
        if wire:
            faces = PolyCollection(flat, edgecolors="black", linewidths=0.25, cmap="YlOrRd", rasterized=True)
            faces.set_array(size)
            faces.set_clim(0, self.PUSH)
        else:
            light = np.array([-0.55, -0.8, -0.1])
            shade = 0.25 + 0.75 * np.clip(normal[order] @ (light / np.linalg.norm(light)), 0, 1)
            colors = np.outer(shade, [0.86, 0.52, 0.45])
            faces = PolyCollection(flat, facecolors=colors, edgecolors=colors, linewidths=0.3, rasterized=True)
        axes.add_collection(faces)
        tip = (self.contact + [0, 0, self.PUSH]) @ self.view.T
        hub = (self.contact - [0, 0, 14]) @ self.view.T
        axes.plot([hub[0], tip[0]], [hub[2], tip[2]], color="tab:blue", linewidth=2, solid_capstyle="round")
        axes.set(aspect="equal")
        axes.autoscale_view()
        axes.axis("off")
        return faces


def figure4(gland, folder):
    figure, grid = plt.subplots(2, 2, figsize=(8, 7.6))
    cases = [("psi30", 12), ("psi31", 12), ("psi30", 6), ("psi31", 6)]
    for axes, letter, (kernel, a) in zip(grid.flat, "abcd", cases):
        u = gland.deformed(kernel, a, True)
        faces = gland.draw(axes, u, wire=True)
        axes.set_title(f"({letter}) {KERNELS[kernel]}, a = {a} mm")
    figure.suptitle(f"Figure 4: the gland's mesh, eight anchors, pushed {gland.PUSH} mm at the apex")
    figure.tight_layout(rect=(0, 0, 0.9, 1))
    bar = figure.colorbar(faces, cax=figure.add_axes((0.92, 0.25, 0.015, 0.5)))
    bar.set_label("displacement, mm")
    figure.savefig(folder / "figure4.svg", dpi=100, metadata={"Date": None})


def figure5(gland, folder):
    figure, pair = plt.subplots(1, 2, figsize=(8, 4.3))
    for axes, letter, (kernel, a, anchors) in zip(pair, "ab", (("psi30", 6, True), ("psi31", 12, False))):
        u = gland.deformed(kernel, a, anchors)
        gland.draw(axes, u, wire=False)
        axes.set_title(f"({letter}) {KERNELS[kernel]}, a = {a} mm, {'eight anchors' if anchors else 'no anchors'}")
    figure.suptitle(f"Figure 5: the gland's surface, pushed {gland.PUSH} mm at the apex")
    figure.tight_layout(rect=(0, 0, 1, 0.97))
    figure.savefig(folder / "figure5.svg", dpi=100, metadata={"Date": None})


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        engine = Engine(sys.argv[1], work)
        figure1(engine, folder)
        figures_2_and_3(engine, folder)
        gland = Gland(engine)
        figure4(gland, folder)
        figure5(gland, folder)


main()
