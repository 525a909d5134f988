#!/usr/bin/env python3
"""The dose of the sixteen sessions by a TG-43U1 sum of its own, in numpy: shares no code with the program, only the
phantom's surfaces, as files, and the seeds' places, which generators.py derives from the hands' motion.

  oracle.py STRUCTURES [NAME ...] > expected.json     STRUCTURES: written by `brachy plan --structures`
  oracle.py STRUCTURES --seeds FILE                   the same figures of the seeds at rest in a session's seeds.csv

Formalism and tables: Rivard et al., Med. Phys. 31 (2004) 633-674, equations 1 and 4, section IV, source 6711; g and F
are interpolated as in the supplement, Med. Phys. 34 (2007) 2187-2205."""
import csv
import functools
import json
import os
import re
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import generators  # noqa: E402

ACTIVE_CM, RATE_CONSTANT, HALF_LIFE_H = 0.3, 0.965, 59.4 * 24
G_R = np.array([0.1, 0.15, 0.25, 0.5, 0.75, 1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9, 10])
G = np.array([1.055, 1.078, 1.082, 1.071, 1.042, 1, 0.908, 0.814, 0.632, 0.496, 0.364, 0.27, 0.199, 0.148, 0.109,
              0.0803])
F_R = np.array([0.5, 1, 2, 3, 4, 5])
F_THETA = np.array([0, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90.0])
F = np.array([[0.333, 0.37, 0.442, 0.488, 0.52, 0.55], [0.4, 0.429, 0.497, 0.535, 0.561, 0.587],
              [0.519, 0.537, 0.58, 0.609, 0.63, 0.645], [0.716, 0.705, 0.727, 0.743, 0.752, 0.76],
              [0.846, 0.834, 0.842, 0.846, 0.848, 0.852], [0.926, 0.925, 0.926, 0.926, 0.928, 0.928],
              [0.972, 0.972, 0.97, 0.969, 0.969, 0.969], [0.991, 0.991, 0.987, 0.987, 0.987, 0.987],
              [0.996, 0.996, 0.996, 0.995, 0.995, 0.995], [1, 1, 1, 0.999, 0.999, 0.999], [1, 1, 1, 1, 1, 1]])


def geometry(r, theta):
    """G_L, cm⁻²: the angle that the line source subtends over L r sin θ."""
    across, along, half = r * np.sin(theta), r * np.cos(theta), ACTIVE_CM / 2
    angle = np.arctan2(along + half, across) - np.arctan2(along - half, across)
    return np.where(across > 1e-6, angle / (ACTIVE_CM * np.maximum(across, 1e-9)),
                    1 / np.maximum(r * r - half * half, 1e-9))


def radial(r):
    """Log-linear in r; nearest below the table, the last piece carried on above it."""
    log = np.interp(r, G_R, np.log(G))
    slope = (np.log(G[-1]) - np.log(G[-2])) / (G_R[-1] - G_R[-2])
    return np.exp(np.where(r > G_R[-1], np.log(G[-1]) + slope * (r - G_R[-1]), log))


def anisotropy(r, theta_deg):
    r, theta_deg = np.clip(r, F_R[0], F_R[-1]), np.minimum(theta_deg, 180 - theta_deg)
    i = np.clip(np.searchsorted(F_THETA, theta_deg, side="right") - 1, 0, len(F_THETA) - 2)
    j = np.clip(np.searchsorted(F_R, r, side="right") - 1, 0, len(F_R) - 2)
    a = (theta_deg - F_THETA[i]) / (F_THETA[i + 1] - F_THETA[i])
    b = (r - F_R[j]) / (F_R[j + 1] - F_R[j])
    return (1 - a) * ((1 - b) * F[i, j] + b * F[i, j + 1]) + a * ((1 - b) * F[i + 1, j] + b * F[i + 1, j + 1])


def dose_gy(points, seeds, axes, strengths_u):
    """Total dose at points (n×3, mm) of all seeds."""
    return sum((strength * per_unit(points, tuple(seed), tuple(axis))
                for seed, axis, strength in zip(seeds, axes, strengths_u)), np.zeros(len(points)))


@functools.lru_cache(maxsize=400)  # sessions share most of their seeds
def _per_unit(points_id, seed, axis):
    points = POINTS[points_id]
    away = (points - np.asarray(seed)) / 10
    r = np.maximum(np.linalg.norm(away, axis=1), 0.05)
    theta = np.arccos(np.clip(away @ np.asarray(axis) / r, -1, 1))
    reference = geometry(np.array([1.0]), np.array([np.pi / 2]))[0]
    rate = RATE_CONSTANT * geometry(r, theta) / reference * radial(r) * anisotropy(r, np.degrees(theta))
    return (rate * HALF_LIFE_H / np.log(2) / 100).astype(np.float32)


def per_unit(points, seed, axis):
    """Gy of a seed of 1 U."""
    POINTS[id(points)] = points
    return _per_unit(id(points), seed, axis)


POINTS = {}


def read_surface(file):
    """Points and triangles of a .vtp with raw appended blocks."""
    with open(file, "rb") as opened:
        data = opened.read()
    begin = data.index(b'encoding="raw">') + len(b'encoding="raw">')
    begin = data.index(b"_", begin) + 1
    head = data[:begin].decode()

    def block(name, kind):
        offset = begin + int(re.search(rf'Name="{name}"[^>]*offset="(\d+)"', head).group(1))
        size = int.from_bytes(data[offset:offset + 8], "little")
        return np.frombuffer(data[offset + 8:offset + 8 + size], kind)
    return block("Points", "<f4").reshape(-1, 3).astype(float), block("connectivity", "<i4").reshape(-1, 3)


def points_inside(points, triangles, step, keep=None):
    """A lattice inside a closed surface: columns along z, between the crossings with its triangles."""
    low, high = points.min(0), points.max(0)
    xs = np.arange(low[0] + 0.3717 * step, high[0], step)
    ys = np.arange(low[1] + 0.4193 * step, high[1], step)
    crossings = {}
    for t in triangles:
        a, b, c = points[t]
        det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if det == 0:
            continue
        for i in range(*np.searchsorted(xs, (min(a[0], b[0], c[0]), max(a[0], b[0], c[0])))):
            for j in range(*np.searchsorted(ys, (min(a[1], b[1], c[1]), max(a[1], b[1], c[1])))):
                u = ((xs[i] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (ys[j] - a[1])) / det
                v = ((b[0] - a[0]) * (ys[j] - a[1]) - (xs[i] - a[0]) * (b[1] - a[1])) / det
                if u >= 0 and v >= 0 and u + v <= 1:
                    crossings.setdefault((i, j), []).append(a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]))
    zs = np.arange(low[2] + 0.2871 * step, high[2], step)
    inside = []
    for (i, j), z in crossings.items():
        z.sort()
        for bottom, top in zip(z[::2], z[1::2]):
            column = zs[(zs > bottom) & (zs < top)]
            inside.append(np.column_stack([np.full(len(column), xs[i]), np.full(len(column), ys[j]), column]))
    found = np.concatenate(inside)
    return found if keep is None else found[keep(found)]


class Phantom:
    STEP_MM = {"prostate": 0.7, "urethra": 0.3, "rectum": 0.7}

    def __init__(self, folder):
        self.points = {}
        for name, step in self.STEP_MM.items():
            surface = read_surface(os.path.join(folder, name + ".vtp"))
            # The hottest 2 cm³ of the rectum lie at its front.
            keep = (lambda p: (p[:, 1] > -37) & (abs(p[:, 2]) < 33)) if name == "rectum" else None
            self.points[name] = points_inside(*surface, step, keep)

    def figures(self, seeds, axes, strengths_u, prescription_gy):
        gy = {name: dose_gy(points, seeds, axes, strengths_u) for name, points in self.points.items()}
        prostate = gy["prostate"]
        hottest = max(1, round(2000 / self.STEP_MM["rectum"] ** 3))
        return {"V100_percent": 100 * float(np.mean(prostate >= prescription_gy)),
                "V150_percent": 100 * float(np.mean(prostate >= 1.5 * prescription_gy)),
                "D90_gy": float(np.quantile(prostate, 0.1)),
                "urethra_D30_gy": float(np.quantile(gy["urethra"], 0.7)),
                "rectum_D2cc_gy": float(np.sort(gy["rectum"])[-hottest])}


def main():
    folder, *rest = sys.argv[1:]
    plan = generators.load_plan()
    phantom = Phantom(folder)
    if rest[:1] == ["--seeds"]:
        with open(rest[1]) as file:
            rows = list(csv.DictReader(file))
        seeds = [[float(row["rest_" + k]) for k in "xyz"] for row in rows]
        axes = [[float(row["rest_a" + k]) for k in "xyz"] for row in rows]
        figures = phantom.figures(seeds, axes, [float(row["strength_u"]) for row in rows], plan["prescription_gy"])
        return print(json.dumps(figures, indent=1))
    expected = {}
    for name in rest or generators.SESSIONS:
        seeds = generators.Session(name, plan).device.seeds
        figures = phantom.figures(seeds, [(0, 0, 1)] * len(seeds), [plan["air_kerma_strength_u"]] * len(seeds),
                                  plan["prescription_gy"])
        print(name, file=sys.stderr, flush=True)
        expected[name] = {"seeds": len(seeds), **{k: round(v, 3) for k, v in figures.items()}}
    print(json.dumps(expected, indent=1))


if __name__ == "__main__":
    main()
