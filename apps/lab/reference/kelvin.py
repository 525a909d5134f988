"""The regularised Kelvin kernel and the observations of it that landmarks are made of.

Everything follows from one potential, phi = sqrt(r² + s + s'): G = 1/(4 pi mu) [½ lap(phi) I - b grad grad phi],
b = 1/(4(1-nu)); s = c²/2 for a landmark of core radius c. An observation is a displacement or, with a normal, a
traction sigma(G) n; blocks are the observations applied to both sides of G, so any set of them gives a positive
definite matrix.
"""
import numpy as np


def _radial(x, s):
    """x (n,m,3), s (n,m): derivatives (1/r d/dr)^k of phi for k = 1..4, and of psi = ½ lap(phi) for k = 0..2."""
    q = (x * x).sum(-1) + s
    f1 = 1 / np.sqrt(q)
    iq = f1 * f1
    f2 = -f1 * iq
    f3 = -3 * f2 * iq
    f4 = -5 * f3 * iq
    p0 = f1 + 0.5 * s * f1 * iq
    p1 = -f1 * iq - 1.5 * s * f1 * iq**2
    p2 = 3 * f1 * iq**2 + 7.5 * s * f1 * iq**3
    return f1, f2, f3, f4, p0, p1, p2


EYE = np.eye(3)


def _flat(block):
    n, m = block.shape[:2]
    return block.transpose(0, 2, 1, 3).reshape(3 * n, 3 * m)


def displacement(X, sx, Y, sy, nu):
    """3n×3m: displacement at X of unit forces at Y; shear modulus 1."""
    b = 1 / (4 * (1 - nu))
    x = X[:, None] - Y[None]
    q = (x * x).sum(-1) + sx[:, None] + sy[None]
    i1 = 1 / np.sqrt(q)
    i3 = i1**3
    s = sx[:, None] + sy[None]
    block = (b * i3)[..., None, None] * x[..., :, None] * x[..., None, :]
    diag = (1 - b) * i1 + 0.5 * s * i3
    for k in range(3):
        block[..., k, k] += diag
    return _flat(block) / (4 * np.pi)


def _gradient(x, s, nu):
    """(n,m,3,3,3): d/dx_k of G_ij."""
    b = 1 / (4 * (1 - nu))
    f1, f2, f3, f4, p0, p1, p2 = _radial(x, s)
    D = -b * f3[..., None, None, None] * np.einsum("nmi,nmj,nmk->nmijk", x, x, x)
    c = -b * f2
    D += np.einsum("nm,ij,nmk->nmijk", p1 + c, EYE, x)
    D += np.einsum("nm,ik,nmj->nmijk", c, EYE, x)
    D += np.einsum("nm,jk,nmi->nmijk", c, EYE, x)
    return D / (4 * np.pi)


def _traction_of(D, n, nu):
    """D (n,m,3,3,3) = d_k u_i for source j; n (n,1,3): sigma n, (n,m,3,3)."""
    lam = 2 * nu / (1 - 2 * nu)
    n = np.broadcast_to(n, D.shape[:2] + (3,))
    div = np.einsum("nmkjk->nmj", D)
    return (lam * n[..., :, None] * div[..., None, :] + np.einsum("nmijk,nmk->nmij", D, n)
            + np.einsum("nmkji,nmk->nmij", D, n))


def traction(X, nx, sx, Y, sy, nu):
    """3n×3m: traction on the plane nx at X of unit forces at Y."""
    x = X[:, None] - Y[None]
    return _flat(_traction_of(_gradient(x, sx[:, None] + sy[None], nu), nx[:, None], nu))


def traction_traction(X, nx, sx, Y, ny, sy, nu):
    """3n×3m: traction at X of the traction observation's source at Y (symmetric, positive definite). Chunked by
    rows."""
    rows = max(1, int(2e5 // len(Y)))
    parts = []
    b = 1 / (4 * (1 - nu))
    lam = 2 * nu / (1 - 2 * nu)
    for a in range(0, len(X), rows):
        xa, na, sa = X[a:a + rows], nx[a:a + rows], sx[a:a + rows]
        x = xa[:, None] - Y[None]
        n, m = x.shape[:2]
        f1, f2, f3, f4, p0, p1, p2 = _radial(x, sa[:, None] + sy[None])
        # H_ijkl = d_k d_l G_ij, then -lam/mu operators on (i,k) with nx and on (j,l) with ny.
        xx = x[..., :, None] * x[..., None, :]
        H = np.einsum("nm,nmij,nmkl->nmijkl", -b * f4, xx, xx)
        c3 = -b * f3
        H += np.einsum("nm,ij,nmkl->nmijkl", p2 + c3, EYE, xx)
        for e, f in (("ik", "jl"), ("il", "jk"), ("jk", "il"), ("jl", "ik"), ("kl", "ij")):
            H += np.einsum(f"nm,{e},nm{f}->nmijkl", c3, EYE, xx)
        c2 = -b * f2
        H += np.einsum("nm,ijkl->nmijkl", p1 + c2, np.einsum("ij,kl->ijkl", EYE, EYE))
        H += np.einsum("nm,ijkl->nmijkl", c2, np.einsum("ik,jl->ijkl", EYE, EYE) + np.einsum("il,jk->ijkl", EYE, EYE))
        H /= 4 * np.pi
        N = np.broadcast_to(na[:, None], (n, m, 3))
        M = np.broadcast_to(ny[None], (n, m, 3))
        T = (lam * np.einsum("nmi,nmkjkl->nmijl", N, H) + np.einsum("nmijkl,nmk->nmijl", H, N)
             + np.einsum("nmkjil,nmk->nmijl", H, N))
        TT = (lam * np.einsum("nmj,nmill->nmij", M, T) + np.einsum("nmijl,nml->nmij", T, M)
              + np.einsum("nmilj,nml->nmij", T, M))
        parts.append(_flat(-TT))
    return np.vstack(parts)
