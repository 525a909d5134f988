#!/usr/bin/python3
"""Structures whose volume and place are known, drawn as contours in every way that planning systems draw them, through
`brachy import`: what comes back, by numpy from the surfaces that it wrote.

usage: contour_shapes.py BRACHY_IMPORT WORK [--cases N] [--seed N] [--only CASE]
Shapes: ellipsoids, tubes that run oblique, rings with a hole, shells whose hole begins and ends inside. Varied: axis,
sign, order, spacing, obliqueness, jitter between contours of a slice, first point, direction, contours drawn twice,
closed points, keyholes, digits. Truth: the polygons' own areas times the spacing, and their centroids; volume within
1 %, centroid and extent within 0.1 mm.
Prints a line for each case that is off, and how many are right; exit code 1 below 98 %.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import pydicom

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import make_odd_cases as odd

PER_FILE = 40  # structures


def circle(a, b, middle, points, turn=0.0):
    t = 2 * np.pi * np.arange(points) / points
    x, y = a * np.cos(t), b * np.sin(t)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([middle[0] + x * c - y * s, middle[1] + x * s + y * c], 1)


def area_and_middle(polygon):
    p, q = polygon, np.roll(polygon, -1, axis=0)
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    area = cross.sum() / 2
    return abs(area), ((p + q) * cross[:, None]).sum(axis=0) / (6 * area)


def sections(rng, kind, spacing):
    """Of each plane: its height, outer contour, hole or None."""
    points = int(rng.integers(40, 160))
    if kind == "tube":
        radius, slope = rng.uniform(1.5, 5), rng.uniform(0, min(2.5, 12 / spacing))
        count = max(4, int(rng.uniform(15, 40) / spacing))
        way = rng.uniform(0, 2 * np.pi)
        return [(k * spacing, circle(radius, radius, slope * k * spacing * np.array([np.cos(way), np.sin(way)]),
                                     points), None) for k in range(count)]
    a, b, c = rng.uniform(8, 30, 3)
    count = max(6, int(2 * c / spacing))
    heights = (np.arange(count) - (count - 1) / 2) * spacing
    turn = rng.uniform(0, np.pi)
    if kind == "ring":
        wall = rng.uniform(2, 6)
        return [(h, circle(a, b, (0, 0), points, turn), circle(a - wall, b - wall, (0, 0), points, turn))
                for h in heights]
    top = count * spacing / 2
    result = []
    for h in heights:
        share = np.sqrt(1 - (h / top) ** 2)
        hole = None
        if kind == "shell" and abs(h) < 0.5 * top:
            inner = 0.5 * np.sqrt(1 - (h / (0.55 * top)) ** 2)
            hole = circle(a * inner, b * inner, (0, 0), points, turn)
        result.append((h, circle(a * share, b * share, (0, 0), points, turn), hole))
    return result


def redrawn(rng, polygon):
    """The same contour from another first point, perhaps the other way round, perhaps closed."""
    polygon = np.roll(polygon, int(rng.integers(len(polygon))), axis=0)
    if rng.random() < 0.5:
        polygon = polygon[::-1]
    if rng.random() < 0.2:
        polygon = np.concatenate([polygon, polygon[:1]])
    return polygon


def finer(polygon):
    """With the middles of its edges."""
    middles = (polygon + np.roll(polygon, -1, axis=0)) / 2
    return np.stack([polygon, middles], axis=1).reshape(-1, 2)


def frame_of(rng):
    which = rng.integers(4)
    if which == 3:
        Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        return Q * np.sign(np.linalg.det(Q))
    axes = np.roll(np.eye(3), which, axis=1)
    return axes * (1 if rng.random() < 0.5 else np.array([1, -1, -1])[:, None])


def make_case(rng):
    """Contours in LPS, and the truth in RAS."""
    kind = ["ellipsoid", "tube", "ring", "shell"][rng.integers(4)]
    spacing = float(rng.choice([0.5, 1, 1.25, 2, 2.5, 3, 5]))
    planes = sections(rng, kind, spacing)
    R, shift = frame_of(rng), rng.uniform(-150, 150, 3)
    jitter = float(rng.choice([0, 0, 0.011, 0.03, 0.1 * spacing]))
    digits = int(rng.choice([2, 3, 4, 6]))
    twice, keyhole = rng.random() < 0.3, rng.random() < 0.4
    contours, volume, moment, extent = [], 0, 0, []
    for height, outer, hole in planes:
        drawn, of_plane = [outer] if hole is None else [outer, hole], 0
        for n, polygon in enumerate(drawn):
            area, middle = area_and_middle(polygon)
            slab = area * spacing if n == 0 else -area * spacing
            of_plane += slab
            moment = moment + slab * np.array([*middle, 0])
        volume += of_plane
        extent.append(outer)
        if hole is not None and keyhole:
            j = int(rng.integers(len(hole)))
            i = int(np.argmin(np.linalg.norm(outer - hole[j], axis=1)))
            outer, hole = np.roll(outer, -i, axis=0), np.roll(hole, -j, axis=0)[::-1]
            drawn = [np.concatenate([outer, outer[:1], hole[-1:], hole])]
        for polygon in list(drawn):
            if twice and rng.random() < 0.5:
                drawn.append(finer(polygon) if rng.random() < 0.5 else polygon)
        drawn_at = [height + jitter * rng.uniform(-1, 1) for _ in drawn]
        contours += [place(redrawn(rng, polygon), z, R, shift) for polygon, z in zip(drawn, drawn_at)]
        moment = moment + of_plane * np.array([0, 0, np.mean(drawn_at)])
    rng.shuffle(contours)
    middle = R @ (moment / volume) + shift
    every = np.concatenate(extent)
    heights = [p[0] for p in planes]
    return {"kind": kind, "spacing": spacing, "jitter": jitter, "digits": digits, "twice": twice, "keyhole": keyhole,
            "cc": volume / 1000, "middle": [-middle[0], -middle[1], middle[2]],
            "extent": [*np.ptp(every, axis=0), max(heights) - min(heights) + spacing],
            "axes": (np.diag([-1, -1, 1]) @ R).tolist()}, contours


def place(polygon, z, R, shift):
    return np.column_stack([polygon, np.full(len(polygon), z)]) @ R.T + shift


def contour(points, digits):
    item = odd.contour(points)
    item.ContourData = [f"{v:.{digits}f}" for v in points.ravel()]
    return item


def surface(path):
    """Vertices and triangles of a PLY that `brachy import` wrote."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    count = {w[1]: int(w[2]) for w in (line.split() for line in lines) if w[:1] == ["element"]}
    if "format ascii 1.0" in lines:
        rows = body.decode().split("\n")
        v = np.array([row.split()[:3] for row in rows[:count["vertex"]]], float)
        return v, np.array([row.split()[1:4] for row in rows[count["vertex"]:count["vertex"] + count["face"]]], int)
    wide = any(line.startswith("property double x") for line in lines)
    size = 24 if wide else 12
    v = np.frombuffer(body, "<f8" if wide else "<f4", 3 * count["vertex"]).reshape(-1, 3).astype(float)
    f = np.frombuffer(body[size * count["vertex"]:], np.dtype([("n", "u1"), ("t", "<i4", 3)]), count["face"])["t"]
    return v, f


def measured(v, f):
    a, b, c = v[f[:, 0]], v[f[:, 1]], v[f[:, 2]]
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    return volumes.sum() / 1000, (volumes[:, None] * (a + b + c) / 4).sum(axis=0) / volumes.sum()


def fault_of(truth, path):
    v, f = surface(path)
    cc, middle = measured(v - np.array(truth["middle"]), f)
    # Where the heights of contours scatter, so do length and middle.
    if abs(cc / truth["cc"] - 1) > 0.01 + truth["jitter"] / truth["extent"][2]:
        return f"{cc:.4f} cc for {truth['cc']:.4f}"
    if np.linalg.norm(middle) > 0.1 + 0.5 * truth["jitter"]:
        return f"{np.linalg.norm(middle):.3f} mm off"
    extent = np.ptp(v @ np.array(truth["axes"]), axis=0)
    # Of the heights the mean of what jitters.
    slack = np.array([0.2, 0.2, 0.2 + 2 * truth["jitter"]])
    if (abs(extent - truth["extent"]) > slack).any():
        return f"extent {extent.round(3)} for {np.round(truth['extent'], 3)}"
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=80)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int)
    arguments = parser.parse_args()
    right, off = 0, 0
    for begin in range(0, arguments.cases, PER_FILE):
        truths, structures = {}, []
        for n in range(begin, min(begin + PER_FILE, arguments.cases)):
            truth, contours = make_case(np.random.default_rng([arguments.seed, n]))
            if arguments.only is not None and n != arguments.only:
                continue
            name = f"case_{n}"
            truths[name] = truth
            structures.append((n + 1, name, [contour(c, truth["digits"]) for c in contours]))
        if not structures:
            continue
        folder = arguments.work / str(begin)
        shutil.rmtree(folder, ignore_errors=True)
        odd.save(odd.rois(*structures), folder / "in/rtstruct.dcm")
        first = structures[0][1]
        ended = subprocess.run([arguments.program, "import", folder / "in", "--out", folder / "out", "--gland", first],
                               capture_output=True, text=True)
        if ended.returncode != 0:
            print(ended.stderr)
            sys.exit(1)
        for name, truth in truths.items():
            path = folder / "out" / ("prostate.ply" if name == first else name + ".ply")
            fault = fault_of(truth, path) if path.exists() else "not there"
            right, off = right + (fault is None), off + (fault is not None)
            if fault:
                print(name, fault, json.dumps({k: truth[k] for k in list(truth)[:6]}))
    print(f"{right} of {right + off} are right")
    sys.exit(0 if right >= 0.98 * (right + off) and right > 0 else 1)


if __name__ == "__main__":
    main()
