"""Candidate models of the model study: walls, needle and stiff gland as observations of one kernel."""
import pathlib
import sys
import time

import numpy as np
import scipy.linalg as la

import kelvin
from scene import FACES, load_scene

ROOT = pathlib.Path(__file__).resolve().parents[3] / "tests" / "reference"
HOMOGENEOUS = ["push_homogeneous", "straight_homogeneous", "oblique_homogeneous", "lateral_homogeneous"]
STIFF = ["push_stiff", "straight_stiff", "oblique_stiff", "lateral_stiff"]
FREE = ["free_face_homogeneous", "free_face_stiff_lateral"]
LINEAR = HOMOGENEOUS + STIFF + FREE


class Case:
    def __init__(self, name):
        self.name = name
        self.scene = load_scene(ROOT / name)
        read = lambda f: np.loadtxt(ROOT / name / f, delimiter=",", skiprows=1, ndmin=2)
        self.field, self.landmarks = read("field.csv"), read("landmarks.csv")
        self.X, self.U = self.field[:, :3], self.field[:, 3:]
        self.nu = self.scene.poisson
        self.k = self.scene.gland_shear_modulus / self.scene.shear_modulus

    def error(self, u):
        return np.linalg.norm(u - self.U) / np.linalg.norm(self.U)


class Points:
    """Observations: points, s = core²/2, group matrix (rows of point values -> one value), optional normals
    (tractions)."""
    def __init__(self, P, s, n=None, W=None):
        self.P = np.atleast_2d(P)
        self.s = np.broadcast_to(np.asarray(s, float), len(self.P)).copy()
        self.n, self.W = n, W  # W: k×len(P), averages

    def fold(self, rows):
        if self.W is None:
            return rows
        return np.einsum("kp,pcm->kcm", self.W, rows.reshape(len(self.P), 3, -1)).reshape(3 * len(self.W), -1)


def block(a, b, nu):
    """Observations a of the kernel's sources b; shear modulus 1."""
    if a.n is None and b.n is None:
        K = kelvin.displacement(a.P, a.s, b.P, b.s, nu)
    elif a.n is not None and b.n is None:
        K = kelvin.traction(a.P, a.n, a.s, b.P, b.s, nu)
    elif a.n is None:
        K = kelvin.traction(b.P, b.n, b.s, a.P, a.s, nu).T
    else:
        K = kelvin.traction_traction(a.P, a.n, a.s, b.P, b.n, b.s, nu)
    return b.fold(a.fold(K).T).T


def faces(scene, names, n, core, grade=0.0):
    """n×n cells a face, points at the cells' centres, core in cell sizes; grade > 0 pulls the points to the middle."""
    P, N, h = [], [], []
    t = (np.arange(n) + 0.5) / n * 2 - 1
    t = (1 - grade) * t + grade * t**3
    for name in names:
        axis, sign = FACES[name]
        o = [k for k in range(3) if k != axis]
        half = scene.size / 2
        A, B = np.meshgrid(t * half[o[0]], t * half[o[1]], indexing="ij")
        p = np.zeros((n * n, 3))
        p[:, axis] = sign * half[axis]
        p[:, o[0]], p[:, o[1]] = A.ravel(), B.ravel()
        m = np.zeros_like(p)
        m[:, axis] = sign
        P.append(p), N.append(m)
        h.append(np.full(n * n, 2 * half[o[0]] / n))
    if not P:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
    return np.vstack(P), np.vstack(N), core * np.concatenate(h)


def axis_frame(case):
    L = case.landmarks[:, :3]
    if len(L) == 1:
        return None
    a = L[0] - L[-1]
    a /= np.linalg.norm(a)
    e = np.cross(a, [0, 1, 0] if abs(a[1]) < 0.9 else [1, 0, 0])
    e /= np.linalg.norm(e)
    return a, e, np.cross(a, e)


def needle_axis(case, core):
    """Stored landmarks, core in needle radii."""
    c = core * case.scene.radius
    return Points(case.landmarks[:, :3], c * c / 2), case.landmarks[:, 3:]


def shaft_stations(case, spacing):
    """Distances from the tip along the axis, and whether the far end is a round end inside the box."""
    L = case.landmarks[:, :3]
    length = np.linalg.norm(L[0] - L[-1])
    n = max(1, round(length / spacing))
    return np.linspace(0, length, n + 1), not case.scene.shaft_leaves_box()


def needle_ring(case, spacing, m=6, core=0.5, average=True, radius=1.0, end=0.0):
    """Rings of m points on the needle's surface; on the round ends the ring shrinks with the cap. `core` in mm =
    core*R. average: one landmark a ring (its points share one force); else each point is a landmark of its own."""
    R = case.scene.radius
    frame = axis_frame(case)
    if frame is None:
        c = 4 / np.pi * R  # a rigid disc's resistance
        return Points(case.landmarks[:, :3], c * c / 2), case.landmarks[:, 3:]
    a, e, f = frame
    t, rounded = shaft_stations(case, spacing)
    t = t.copy()
    length = t[-1]
    # pull end stations inward by `end` radii
    t = end * R + t * (length - (2 if rounded else 1) * end * R) / length
    depth = np.minimum(t, length - t) if rounded else t
    r = radius * np.where(depth < R, np.sqrt(np.maximum(0, R**2 - (R - depth) ** 2)), R)
    P, W = [], []
    for i, (ti, ri) in enumerate(zip(t, r)):
        mm = m if ri > 0.05 * R else 1
        th = 2 * np.pi * (np.arange(mm) + 0.5 * (i % 2)) / mm
        q = case.landmarks[0, :3] - ti * a + ri * (np.cos(th)[:, None] * e + np.sin(th)[:, None] * f) * (mm > 1)
        P.append(q)
    sizes = [len(p) for p in P]
    P = np.vstack(P)
    c = core * R
    if average:
        W = np.zeros((len(sizes), len(P)))
        k = 0
        for i, z in enumerate(sizes):
            W[i, k:k + z] = 1 / z
            k += z
        return Points(P, c * c / 2, W=W), np.tile(case.landmarks[0, 3:], (len(sizes), 1))
    return Points(P, c * c / 2), np.tile(case.landmarks[0, 3:], (len(P), 1))


def solve_spd(K, rhs):
    K = 0.5 * (K + K.T)
    d = 1 / np.sqrt(np.diag(K))
    Ks = K * d[:, None] * d[None]
    jitter = 1e-12
    while True:
        try:
            c = la.cho_factor(Ks + jitter * np.eye(len(Ks)), lower=True, check_finite=False)
            break
        except la.LinAlgError:
            jitter *= 100
    return d.reshape(-1, *[1] * (rhs.ndim - 1)) * la.cho_solve(c, d.reshape(-1, *[1] * (rhs.ndim - 1)) * rhs), jitter


def elastic_homogeneous(case, needle, walls, free=None, s_field=None):
    """One medium (the surround's modulus drops out): needle, held walls, traction-free faces."""
    nd, d = needle
    obs = [nd, walls] + ([free] if free is not None and len(free.P) else [])
    K = np.block([[block(a, b, case.nu) for b in obs] for a in obs])
    rhs = np.zeros(len(K))
    rhs[:d.size] = d.ravel()
    alpha, jitter = solve_spd(K, rhs)
    s = nd.s[0] if s_field is None else s_field
    F = Points(case.X, s)
    B = np.hstack([block(F, b, case.nu) for b in obs])
    return (B @ alpha).reshape(-1, 3)


def ellipsoid_points(scene, n):
    """n points of the gland's capsule, about evenly by area, their outward normals and the area of each."""
    a = scene.semi_axes
    def spiral(m):
        i = np.arange(m) + 0.5
        z, t = 1 - 2 * i / m, np.pi * (1 + 5**0.5) * i
        r = np.sqrt(1 - z * z)
        return np.stack([r * np.cos(t), r * np.sin(t), z], axis=1)
    u = spiral(n)
    stretch = np.prod(a) * np.sqrt(((u / a) ** 2).sum(1))  # area on the ellipsoid for area on the sphere
    N = u / a
    N /= np.linalg.norm(N, axis=1)[:, None]
    return scene.centre + u * a, N, stretch * 4 * np.pi / n


def two_block(a, b, nu, k):
    """a, b: (Points, weight inside per point, weight outside per point); tractions carry the modulus of their side."""
    (pa, ia, oa), (pb, ib, ob) = a, b
    K = block_raw(pa, pb, nu)
    ta, tb = pa.n is not None, pb.n is not None
    win = np.outer(ia, ib) * (k ** (int(ta) + int(tb) - 1))
    wout = np.outer(oa, ob)
    K = K * np.repeat(np.repeat(win + wout, 3, 0), 3, 1)
    return pb.fold(pa.fold(K).T).T


def block_raw(a, b, nu):
    if a.n is None and b.n is None:
        return kelvin.displacement(a.P, a.s, b.P, b.s, nu)
    if a.n is not None and b.n is None:
        return kelvin.traction(a.P, a.n, a.s, b.P, b.s, nu)
    if a.n is None:
        return kelvin.traction(b.P, b.n, b.s, a.P, a.s, nu).T
    return kelvin.traction_traction(a.P, a.n, a.s, b.P, b.n, b.s, nu)


def sided(case, p, blend=0.0):
    """A landmark in the tissue: its force is felt on the side it lies on."""
    q = np.sqrt((((p.P - case.scene.centre) / case.scene.semi_axes) ** 2).sum(1))
    i = np.where(np.abs(q - 1) < 1e-4, 0.5, (q < 1) * 1.0)
    return p, i, 1 - i


def elastic_two(case, needle, walls, free, interface, s_field=0.0):
    """Gland and surround each with their own kernel; displacement and traction jumps observed to be 0 on the
    capsule."""
    nd, d = needle
    n = len(walls.P)
    obs = [sided(case, nd), (walls, np.zeros(n), np.ones(n))]
    if free is not None and len(free.P):
        obs.append((free, np.zeros(len(free.P)), np.ones(len(free.P))))
    iu, it = interface
    one = lambda p: np.ones(len(p.P))
    obs += [(iu, one(iu), -one(iu)), (it, one(it), -one(it))]
    rows = []
    for i, a in enumerate(obs):
        rows.append([two_block(a, b, case.nu, case.k) if j >= i else None for j, b in enumerate(obs)])
    for i in range(len(obs)):
        for j in range(i):
            rows[i][j] = rows[j][i].T
    K = np.block(rows)
    rhs = np.zeros(len(K))
    rhs[:d.size] = d.ravel()
    alpha, jitter = solve_spd(K, rhs)
    F = Points(case.X, s_field)
    B = np.hstack([two_block((F, np.ones(len(case.X)), np.zeros(len(case.X))), b, case.nu, case.k) for b in obs])
    case.jitter = jitter
    return (B @ alpha).reshape(-1, 3)


def local_modulus(case, p):
    """The modulus a landmark's force works against, relative to the surround: that of its side, the mean on the
    capsule."""
    q = np.sqrt((((p.P - case.scene.centre) / case.scene.semi_axes) ** 2).sum(1))
    return np.where(np.abs(q - 1) < 1e-4, 0.5 * (case.k + 1), np.where(q < 1, case.k, 1.0))


def elastic_layer(case, needle, walls, free, capsule, s_field=0.0, free_second_kind=False, out=None):
    """One unit-modulus kernel; a force in tissue of modulus k enters as f/k; the capsule carries a single layer g whose
    traction balance is (K' g + T0) + lambda g/A = 0, lambda = ½ (k+1)/(k-1); a free face is the same
    with lambda = ½."""
    nd, d = needle
    P, N, A, core = capsule
    first = [nd, walls]
    if free is not None and len(free.P) and not free_second_kind:
        first.append(free)
    layers = []
    if case.k != 1:
        layers.append((P, N, A, core, 0.5 * (case.k + 1) / (case.k - 1)))
    if free is not None and len(free.P) and free_second_kind:
        layers.append((free.P, free.n, free.area, np.sqrt(2 * free.s), 0.5))
    src = first + [Points(p, c * c / 2) for p, n, a, c, l in layers]
    tst = first + [Points(p, c * c / 2, n) for p, n, a, c, l in layers]
    K = np.block([[block(t, s, case.nu) for s in src] for t in tst])
    diag = np.zeros(len(K))
    o = len(K)
    for p, n, a, c, l in reversed(layers):
        diag[o - 3 * len(p):o] = np.repeat(l / a, 3)
        o -= 3 * len(p)
    K[np.diag_indices(len(K))] += diag
    if layers:
        m = o
        A_ = K[m:, m:]
        lu = la.lu_factor(A_)
        S = K[:m, :m] - K[:m, m:] @ la.lu_solve(lu, K[m:, :m])
        n0 = 3 * len(d)
        # Asymmetry of what the landmarks see, walls condensed as well.
        rhs = np.zeros(m)
        rhs[:d.size] = d.ravel()
        x = la.solve(S, rhs)
        if out is not None:
            Sw = S[:n0, :n0] - S[:n0, n0:] @ la.solve(S[n0:, n0:], S[n0:, :n0])
            if nd.W is None:
                kl = local_modulus(case, nd)
            else:
                kl = nd.W @ local_modulus(case, nd)
            C = Sw / np.repeat(kl, 3)[None]
            out["force"] = (x[:n0].reshape(-1, 3) * kl[:, None]).sum(0) * case.scene.shear_modulus
            out["asymmetry"] = np.linalg.norm(C - C.T) / np.linalg.norm(C + C.T)
            out["min_eig"] = np.linalg.eigvalsh(0.5 * (C + C.T)).min() / np.linalg.eigvalsh(0.5 * (C + C.T)).max()
            if out.get("symmetrise"):  # what a contact solve would use: forces from the symmetric part
                force = la.solve(0.5 * (C + C.T), d.ravel(), assume_a="pos")
                phi = force / np.repeat(kl, 3)
                x = np.concatenate([phi, -la.solve(S[n0:, n0:], S[n0:, :n0] @ phi)])
        alpha = np.concatenate([x, -la.lu_solve(lu, K[m:, :m] @ x)])
    else:
        rhs = np.zeros(len(K))
        rhs[:d.size] = d.ravel()
        alpha, _ = solve_spd(K, rhs)
    B = np.hstack([block(Points(case.X, s_field), s, case.nu) for s in src])
    return (B @ alpha).reshape(-1, 3)


KAPPA = 0.385  # core of a surface lattice's points, in √(area of a point): 1.5/3.9003 (see MODEL_STUDY.md)


def needle_rule(case, m=6, kappa=0.4, tip=0.3, tail=0.3, spacing=1.5, disc=4 / np.pi):
    """The rule: a landmark on a shaft is a ring of m points on the needle's surface that share one force. Landmarks
    more than `spacing` radii apart get rings between them (displacement interpolated); the tip's ring lies `tip`
    radii behind it where the round end is sqrt(1-(1-tip)²) radii wide. One landmark alone is a contact: a disc, core
    4/pi radii."""
    R, L = case.scene.radius, case.landmarks
    if len(L) == 1:
        return Points(L[:, :3], (disc * R) ** 2 / 2), L[:, 3:]
    a, e, f = axis_frame(case)
    t = np.linalg.norm(L[:, :3] - L[0, :3], axis=1)
    parts = np.maximum(1, np.ceil(np.diff(t) / (spacing * R) - 1e-6).astype(int))
    fine = np.concatenate([t[i] + (t[i + 1] - t[i]) * np.arange(q) / q for i, q in enumerate(parts)] + [[t[-1]]])
    d = np.stack([np.interp(fine, t, L[:, 3 + k]) for k in range(3)], axis=1)
    h = t[-1] / (len(fine) - 1)
    c = kappa * np.sqrt(2 * np.pi * R / m * h)
    r = np.full(len(fine), float(R))  # a radius of "2" in a scene is an int, which would cut the ends to 1 mm
    fine = fine.copy()
    fine[0] += tip * R
    r[0] = R * np.sqrt(1 - (1 - tip) ** 2)
    if tail and not case.scene.shaft_leaves_box():
        fine[-1] -= tail * R
        r[-1] = R * np.sqrt(1 - (1 - tail) ** 2)
    th = 2 * np.pi * (np.arange(m)[None] + 0.5 * (np.arange(len(fine)) % 2)[:, None]) / m
    P = L[0, :3] - fine[:, None, None] * a + r[:, None, None] * (np.cos(th)[..., None] * e + np.sin(th)[..., None] * f)
    return Points(P.reshape(-1, 3), c * c / 2, W=np.kron(np.eye(len(fine)), np.full((1, m), 1 / m))), d


def elastic_condensed(case, needle, walls, free, capsule, kappa_s=None, s_field=0.0, modes=0, on_side=0.5, out=None):
    """Positive definite by construction. G: the kernel with the walls condensed. On a surface between moduli k
    (inside its normal) and 1: S = L L' the single layer, v = L^-1 G(surface, .), kappa = sym(L' A K' L^-T),
        C(x,y) = w(x,y) [G(x,y) - v(x)'v(y)] + v(x)' [½(k+1) I + (k-1) kappa]^-1 v(y),
    w = 2/(k(x)+k(y)), k(x) = k inside, 1 outside, their mean on the surface: surface held, plus the compliance of its
    motion."""
    nd, d = needle
    P, N, A, core = capsule
    F = Points(case.X, s_field)
    nu, k = case.nu, case.k
    t0 = time.time()

    # 1 walls: a function giving the condensed block of any two observations
    Kw = block(walls, walls, nu)
    cw = la.cho_factor(0.5 * (Kw + Kw.T) , lower=True)
    memo = {}

    def half(o, key):
        if key not in memo:
            memo[key] = la.solve_triangular(cw[0], block(walls, o, nu), lower=True)
        return memo[key]

    def Gt(a, ka, b, kb):
        return block(a, b, nu) - half(a, ka).T @ half(b, kb)

    def surface(G_uu, G_tu, G_ul, A, k):
        """G_uu: S; G_tu: traction rows (K'); returns L, M."""
        L = la.cholesky(0.5 * (G_uu + G_uu.T), lower=True)
        AK = np.repeat(A, 3)[:, None] * G_tu
        SK = L.T @ AK
        kap = la.solve_triangular(L, SK.T, lower=True).T
        skew = np.linalg.norm(kap - kap.T) / np.linalg.norm(kap + kap.T)
        kap = 0.5 * (kap + kap.T)
        e, Q = np.linalg.eigh(kap)
        if out is not None:
            out["kappa"] = (e.min(), e.max(), skew)
        return L, e, Q

    s_src = Points(P, core * core / 2)
    s_trc = Points(P, core * core / 2, N)
    if free is not None and len(free.P):
        fs, ft = Points(free.P, free.s), Points(free.P, free.s, free.n)
        Lf, e, Qf = surface(Gt(fs, "fs", fs, "fs"), Gt(ft, "ft", fs, "fs"), None, free.area, 0)
        e = np.clip(e, -0.49, 0.5)
        Mf = 1 / (0.5 + e) - 1  # tissue inside its normal, nothing outside: k = 1 | 0
        def vf(o, key):
            kk = "vf" + key
            if kk not in memo:
                memo[kk] = Qf.T @ la.solve_triangular(Lf, Gt(fs, "fs", o, key), lower=True)
            return memo[kk]
        def Gb(a, ka, b, kb):
            return Gt(a, ka, b, kb) + vf(a, ka).T @ (Mf[:, None] * vf(b, kb))
    else:
        Gb = Gt
    if k == 1:
        C, B = Gb(nd, "n", nd, "n"), Gb(F, "f", nd, "n")
    else:
        L, e2, Q2 = surface(Gb(s_src, "s", s_src, "s"), Gb(s_trc, "t", s_src, "s"), None, A, k)
        e2 = np.clip(e2, -0.5, 0.5)
        M = 1 / (0.5 * (k + 1) + (k - 1) * e2)
        raw = Points(nd.P, nd.s)
        vs = lambda o, key: Q2.T @ la.solve_triangular(L, Gb(s_src, "s", o, key), lower=True)
        vn, vF = vs(raw, "r"), vs(F, "f")
        inside = ((( nd.P - case.scene.centre) / case.scene.semi_axes) ** 2).sum(1)
        side = np.where(np.abs(inside - 1) < 1e-4, on_side, (inside < 1) * 1.0)
        def weight(p, q):
            w = 2 / ((p * k + 1 - p)[:, None] + (q * k + 1 - q)[None])
            return np.repeat(np.repeat(w, 3, 0), 3, 1)
        if modes:  # the capsule moves in polynomials of degree `modes` only
            y = (P - case.scene.centre) / case.scene.semi_axes
            poly = [np.ones(len(P))] + [y[:, i] for i in range(3)]
            if modes > 1:
                poly += [y[:, i] * y[:, j] for i in range(3) for j in range(i, 3)]
            if modes > 2:
                poly += [y[:, i] * y[:, j] * y[:, l] for i in range(3) for j in range(i, 3) for l in range(j, 3)]
            E = np.kron(np.stack(poly, 1), np.eye(3))
            z = Q2.T @ la.solve_triangular(L, E, lower=True)
            Zi = np.linalg.pinv(z.T @ (z / M[:, None]), rcond=1e-10)
            motion = lambda p, q: (p.T @ z) @ Zi @ (z.T @ q)
        else:
            motion = lambda p, q: p.T @ (M[:, None] * q)
        C = weight(side, side) * (Gb(raw, "r", raw, "r") - vn.T @ vn) + motion(vn, vn)
        B = weight(np.ones(len(case.X)), side) * (Gb(F, "f", raw, "r") - vF.T @ vn) + motion(vF, vn)
        C = raw_fold(nd, raw_fold(nd, C).T).T
        B = raw_fold(nd, B.T).T
    C = 0.5 * (C + C.T)
    if out is not None:
        ev = np.linalg.eigvalsh(C)
        out["min_eig"] = ev[0] / ev[-1]
        out["C"] = C
    f = la.cho_solve(la.cho_factor(C, lower=True), d.ravel())
    if out is not None:
        out["force"] = f.reshape(-1, 3).sum(0) * case.scene.shear_modulus
    return (B @ f).reshape(-1, 3)


def raw_fold(p, rows):
    return p.fold(rows)


# ---- strain landmarks (Lippmann–Schwinger): the prototype's way, for comparison --------------------------------------

VOIGT = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]


def strain_cells(scene, h):
    """Cells of a cubic grid of spacing h that fill the gland: centres and volumes (8³ samples a cell)."""
    n = np.ceil(scene.semi_axes / h).astype(int) + 1
    g = np.stack(np.meshgrid(*[np.arange(-m, m) + 0.5 for m in n], indexing="ij"), -1).reshape(-1, 3) * h
    o = (np.arange(6) + 0.5) / 6 - 0.5
    o = np.stack(np.meshgrid(o, o, o, indexing="ij"), -1).reshape(-1, 3) * h
    inside = ((((g[:, None] + o[None]) / scene.semi_axes) ** 2).sum(-1) < 1)
    share = inside.mean(1)
    keep = share > 0.1
    centre = np.array([(g[i] + o[inside[i]]).mean(0) for i in np.flatnonzero(keep)])
    return centre + scene.centre, share[keep] * h**3


def strain_rows(P, sp, Y, sy, nu):
    """6n×3m: strains (Voigt, engineering shear) at P of unit forces at Y."""
    D = kelvin._gradient(P[:, None] - Y[None], sp[:, None] + sy[None], nu)  # n,m,i,j,k
    return np.stack([D[:, :, 0, :, 0], D[:, :, 1, :, 1], D[:, :, 2, :, 2], D[:, :, 1, :, 2] + D[:, :, 2, :, 1],
                     D[:, :, 0, :, 2] + D[:, :, 2, :, 0], D[:, :, 0, :, 1] + D[:, :, 1, :, 0]], 2
                    ).transpose(0, 2, 1, 3).reshape(6 * len(P), 3 * len(Y))


def strain_strain(P, s, nu):
    """6n×6n, the same observation on both sides; by central differences of strain_rows in the source (1e-4 mm)."""
    e, n = 1e-3, len(P)
    out = np.zeros((6 * n, n, 6))
    for k in range(3):
        d = np.zeros(3)
        d[k] = e
        g = -(strain_rows(P, s, P + d, s, nu) - strain_rows(P, s, P - d, s, nu)).reshape(6 * n, n, 3) / (2 * e)
        # source strain component from derivative d/dy_k of force j: -d/dx
        for v, (a, b) in enumerate(VOIGT):
            if a == b == k:
                out[:, :, v] -= g[:, :, a]
            elif a != b and k in (a, b):
                out[:, :, v] -= g[:, :, b if k == a else a]
    return out.reshape(6 * n, 6 * n)


def elastic_strain(case, needle, walls, free, h, core=0.8, s_field=None, out=None, average=0):
    """K_eff = K - K_t' (K_tt + (dC V)^-1)^-1 K_t with walls and strain landmarks condensed jointly; unit modulus =
    surround. average: strains averaged over average³ points a cell instead of taken at its centre."""
    nd, d = needle
    obs = [nd, walls] + ([free] if free is not None and len(free.P) else [])
    K = np.block([[block(a, b, case.nu) for b in obs] for a in obs])
    F = Points(case.X, nd.s[0] if s_field is None else s_field)
    B = np.hstack([block(F, b, case.nu) for b in obs])
    if case.k != 1:
        P, V = strain_cells(case.scene, h)
        s = (core * V ** (1 / 3)) ** 2  # cores sqrt(s)
        dl = (case.k - 1) * 2 * case.nu / (1 - 2 * case.nu)
        dC = np.diag([2.0, 2, 2, 1, 1, 1]) * (case.k - 1)
        dC[:3, :3] += dl
        noise = np.linalg.inv(dC)
        parts = []
        for b in obs:
            if b.n is None:
                parts.append(b.fold(strain_rows(P, s, b.P, b.s, case.nu).T).T)
            else:  # a traction source, by differences along its derivative directions
                e = 1e-3
                col = np.zeros((6 * len(P), len(b.P), 3))
                lam = 2 * case.nu / (1 - 2 * case.nu)
                g = []
                for k in range(3):
                    t = np.zeros(3)
                    t[k] = e
                    g.append((strain_rows(P, s, b.P + t, b.s, case.nu) - strain_rows(P, s, b.P - t, b.s, case.nu)
                              ).reshape(6 * len(P), len(b.P), 3) / (2 * e))
                g = np.stack(g, -1)  # rows, point, j, k
                col += lam * b.n[None] * np.einsum("rpkk->rp", g)[..., None]
                col += np.einsum("rpjk,pk->rpj", g, b.n) + np.einsum("rpkj,pk->rpj", g, b.n)
                parts.append(col.reshape(6 * len(P), -1))
        T = np.hstack(parts)
        TT = strain_strain(P, s, case.nu)
        for i in range(len(P)):
            TT[6 * i:6 * i + 6, 6 * i:6 * i + 6] += noise / V[i]
        TF = strain_rows(P, s, case.X, F.s, case.nu).T
        K = np.block([[K, T.T], [T, TT]])
        B = np.hstack([B, TF])
        if out is not None:
            out["cells"] = len(P)
    rhs = np.zeros(len(K))
    rhs[:d.size] = d.ravel()
    alpha, j = solve_spd(K, rhs)
    if out is not None:
        out["jitter"] = j
    return (B @ alpha).reshape(-1, 3)
