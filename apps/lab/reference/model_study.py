#!/usr/bin/python3
"""Scores candidate models on the stored reference scenes (relative L2 over field.csv) and prints a Markdown table.

examples:
  apps/lab/reference/model_study.py                    # all rows, about five minutes of one processor
  apps/lab/reference/model_study.py --only elastic     # rows whose name contains this
  apps/lab/reference/model_study.py --scenes DIR
      # other scenes: DIR/*/{scene.toml,load.toml,landmarks.csv,field.csv}
Nothing is tuned per scene: a row is one rule with the same constants everywhere. Exit codes: 0 done, 2 bad input.
"""
import argparse
import pathlib
import sys
import time

import numpy as np
import scipy.linalg as la
from scipy.optimize import nnls

import study_models as lm
from study_models import Case, Points, ellipsoid_points, faces
from scene import FACES


def walls(case, n=5, core=0.7):
    P, N, c = faces(case.scene, case.scene.held, n, core)
    return Points(P, c**2 / 2)


def free(case, n=8, core=0.7):
    names = [f for f in FACES if f not in case.scene.held]
    P, N, c = faces(case.scene, names, n, core)
    p = Points(P, c**2 / 2, N)
    p.area = (c / core) ** 2
    return p


def capsule(case, n, core):
    P, N, A = ellipsoid_points(case.scene, n)
    return P, N, A, core * np.sqrt(A)


# ---- compact kernels -------------------------------------------------------------------------------------------------

def psi(name, r):
    q = np.maximum(0, 1 - r)
    if name == "psi30":
        return q**2
    if name == "psi31":
        return q**4 * (4 * r + 1)
    if name == "psi32":
        return q**6 * (35 / 3 * r * r + 6 * r + 1)
    s = np.clip(r, 1e-300, 1)
    return np.where(r < 1, 12 * s**4 * np.log(s) - 21 * s**4 + 32 * s**3 - 12 * s**2 + 1, 0)


def paper_anchors(case, seed=1):
    """8 random points of the gland's surface, scaled by 0.5 about its centroid."""
    g = np.random.default_rng(seed).normal(size=(8, 3))
    g /= np.linalg.norm(g, axis=1)[:, None]
    return case.scene.centre + 0.5 * g * case.scene.semi_axes


def scalar_kernel(case, f, anchors):
    P = np.vstack([case.landmarks[:, :3], anchors])
    d = np.vstack([case.landmarks[:, 3:], np.zeros((len(anchors), 3))])
    dist = lambda A, B: np.linalg.norm(A[:, None] - B[None], axis=2)
    K = f(dist(P, P))
    return f(dist(case.X, P)) @ la.solve(K + 1e-10 * K[0, 0] * np.eye(len(K)), d)


SUPPORTS = [3, 6, 12, 24, 48]


def fit(nu, core, full, supports, wall):
    """NNLS of the compact terms to the regularised Kelvin kernel (core in mm), across and along, r in 0..48 mm,
    weighted by the root of r + core; wall > 0: to the kernel less its mean value (of the three directions) at that
    distance, where the tissue is held. Returns w, v and the relative residual."""
    b, r = 1 / (4 * (1 - nu)), np.linspace(0, 48, 241)
    mean = lambda q, r: ((1 - b) / q + core**2 / (2 * q**3)) + b / 3 * r * r / q**3
    q = np.sqrt(r * r + core**2)
    across = (1 - b) / q + core**2 / (2 * q**3)
    along = across + b * r * r / q**3
    if wall:
        rest = mean(np.sqrt(wall**2 + core**2), wall)
        across, along = across - rest, along - rest
    if not full:
        across = along = (2 * across + along) / 3
    cols = []
    for a in supports:
        p = psi("psi31", r / a)
        cols.append(np.concatenate([p, p]))
    if full:
        for a in supports:
            t = r / a
            k = np.maximum(0, 1 - t) ** 4
            cols.append(np.concatenate([k * (1 + 4 * t - 20 * t * t), k * (1 + 4 * t - 5 * t * t)]))
    y = np.concatenate([across, along])
    weight = np.sqrt(np.concatenate([r, r]) + core)
    x, res = nnls(np.stack(cols, 1) * weight[:, None], y * weight)
    return x[:len(supports)], x[len(supports):], res / np.linalg.norm(y * weight)


def compact(case, full, way, out=None):
    """way: "wall" (supports up to the wall, fitted to the kernel less its value there), "free" (Kelvin as it is,
    supports to 96 mm), "anchors" (the same with 96 wall anchors)."""
    anchored, supports = way == "anchors", SUPPORTS if way == "wall" else SUPPORTS + [96]
    w, v, res = fit(case.nu, 1.25 * case.scene.radius, full, supports,
                    case.scene.size.min() / 2 if way == "wall" else 0)
    if out is not None:
        out["fit"] = w, v, res
    L = case.landmarks
    P, d = L[:, :3], L[:, 3:]
    if anchored:
        A = walls(case, 4, 0.7).P
        P, d = np.vstack([P, A]), np.vstack([d, np.zeros((len(A), 3))])

    def kernel(A, B):
        x = A[:, None] - B[None]
        r = np.linalg.norm(x, axis=2)
        diag = sum(w[i] * psi("psi31", r / a) for i, a in enumerate(supports))
        outer = np.zeros_like(r)
        if full:
            for i, a in enumerate(supports):
                t = r / a
                q = np.maximum(0, 1 - t) ** 4
                diag = diag + v[i] * q * (1 + 4 * t - 20 * t * t)
                outer += v[i] * 15 * q / a**2
        K = outer[..., None, None] * x[..., :, None] * x[..., None, :] + diag[..., None, None] * np.eye(3)
        return K.transpose(0, 2, 1, 3).reshape(3 * len(A), 3 * len(B))
    alpha, _ = lm.solve_spd(kernel(P, P), d.ravel())
    return (kernel(case.X, P) @ alpha).reshape(-1, 3)


# ---- rows ------------------------------------------------------------------------------------------------------------

def rows():
    out = []
    for name in ("psi30", "psi31", "psi32", "buhmann"):
        for a in (6, 12, 24, 48, 96):
            for anchored in (False, True):
                out.append((f"{name} a={a}" + (" +8 anchors" if anchored else ""),
                            lambda c, o, name=name, a=a, anchored=anchored:
                            scalar_kernel(c, lambda r: psi(name, r / a),
                                          paper_anchors(c) if anchored else np.zeros((0, 3)))))
    for full in (False, True):
        for way, text in (("wall", "supports to the wall"), ("free", "Kelvin's tail, no walls"),
                          ("anchors", "the same, 96 wall anchors")):
            out.append((("compact_elastic" if full else "multiscale") + ", " + text,
                        lambda c, o, full=full, way=way: compact(c, full, way, o)))
    E = lambda label, f: out.append(("elastic: " + label, f))
    E("axis, core 1.25 R; gland ignored",
      lambda c, o: lm.elastic_homogeneous(c, lm.needle_axis(c, 1.25), walls(c, 4), free(c)))
    E("axis, core 1.65 R; gland ignored",
      lambda c, o: lm.elastic_homogeneous(c, lm.needle_axis(c, 1.65), walls(c, 4), free(c)))
    E("rings; gland ignored", lambda c, o: lm.elastic_homogeneous(c, lm.needle_rule(c), walls(c), free(c), s_field=0.0))
    E("axis 1.25 R, 200 strain landmarks", lambda c, o: lm.elastic_strain(
        c, lm.needle_axis(c, 1.25), walls(c, 4), free(c), 6.5))
    E("axis 1.65 R, 200 strain landmarks", lambda c, o: lm.elastic_strain(
        c, lm.needle_axis(c, 1.65), walls(c, 4), free(c), 6.5))
    E("rings, 200 strain landmarks", lambda c, o: lm.elastic_strain(
        c, lm.needle_rule(c), walls(c), free(c), 6.5, s_field=0.0))
    E("rings, 200 strain landmarks of core 0.6", lambda c, o: lm.elastic_strain(
        c, lm.needle_rule(c), walls(c), free(c), 6.5, core=0.6, s_field=0.0))

    def jump(c, o):
        P, N, A = ellipsoid_points(c.scene, 200)
        h = np.sqrt(A)
        return lm.elastic_two(c, lm.needle_rule(c), walls(c), free(c),
                              (Points(P, (0.7 * h) ** 2 / 2), Points(P, (0.7 * h) ** 2 / 2, N)))
    E("rings, 200 jump landmarks", jump)
    for m in (1, 2, 3):
        E(f"rings, capsule condensed 200, its motion of degree {m}", lambda c, o, m=m: lm.elastic_condensed(
            c, lm.needle_rule(c), walls(c), free(c), capsule(c, 200, 0.7), modes=m, out=o))
    E("rings, capsule layer 200", lambda c, o: lm.elastic_layer(c, lm.needle_rule(
        c), walls(c), free(c), capsule(c, 200, 0.5), free_second_kind=True))

    def sym(c, o):
        o["symmetrise"] = True
        return lm.elastic_layer(c, lm.needle_rule(c), walls(c), free(c), capsule(c, 200, 0.5),
                                free_second_kind=True, out=o)
    E("rings, capsule layer 200, symmetrised", sym)
    for n in (100, 200, 300, 400):
        E(f"rings, capsule condensed {n}", lambda c, o, n=n: lm.elastic_condensed(
            c, lm.needle_rule(c), walls(c), free(c), capsule(c, n, 0.7), out=o))
    for n in (100, 200, 300, 400):
        E(f"rings, capsule condensed {n}, contact as inside", lambda c, o, n=n: lm.elastic_condensed(
            c, lm.needle_rule(c), walls(c), free(c), capsule(c, n, 0.7), on_side=1.0, out=o))
    E("axis 1.65 R, capsule condensed 300, contact as inside", lambda c, o: lm.elastic_condensed(c, lm.needle_axis(
        c, 1.65), walls(c), free(c), capsule(c, 300, 0.7), on_side=1.0, s_field=lm.needle_axis(c, 1.65)[0].s[0], out=o))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="TEXT")
    parser.add_argument("--scenes", metavar="DIR", type=pathlib.Path)
    options = parser.parse_args()
    if options.scenes:
        lm.ROOT = options.scenes
        groups = {"mean": sorted(f.parent.name for f in options.scenes.glob("*/landmarks.csv"))}
    else:
        groups = {"homogeneous, held": lm.HOMOGENEOUS, "stiff, held": lm.STIFF, "free face": lm.FREE}
    names = [n for g in groups.values() for n in g]
    if not names:
        print("model_study: no scenes found", file=sys.stderr)
        return 2
    cases = {n: Case(n) for n in names}
    print("| model | " + " | ".join(groups) + " | " + " | ".join(n.replace("_", " ") for n in names) + " | s a scene |")
    print("|---" * (2 + len(groups) + len(names)) + "|")
    for label, f in rows():
        if options.only not in label:
            continue
        t, e = time.time(), {}
        for n, c in cases.items():
            e[n] = c.error(f(c, {}))
        means = [np.mean([e[n] for n in g]) for g in groups.values()]
        print(f"| {label} | " + " | ".join(f"**{100 * m:.1f}**" for m in means) + " | "
              + " | ".join(f"{100 * v:.1f}" for v in e.values())
              + f" | {(time.time() - t) / len(cases):.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
