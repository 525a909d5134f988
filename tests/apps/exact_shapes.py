"""Structures whose distances are known exactly, as meshes, and figures of their doses: for scripts that judge."""
import numpy as np


def ball(radius, middle):
    """Triangles of a sphere, from an icosahedron divided four times, of the volume that corners on it would lack."""
    g = (1 + 5**0.5) / 2
    corners = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
                        (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)], float)
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
    t = corners[np.array(faces)]
    for _ in range(4):
        a, b, c = t[:, 0], t[:, 1], t[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        t = np.concatenate([np.stack(s, 1) for s in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    t /= np.linalg.norm(t, axis=2, keepdims=True)
    volume = np.sum(t[:, 0] * np.cross(t[:, 1], t[:, 2])) / 6
    return middle + radius * (4 / 3 * np.pi / abs(volume)) ** (1 / 3) * t


def rod(radius, middle, half_length):
    """A cylinder along z with round ends: the upper and the lower half of a ball, drawn apart."""
    t = ball(radius, np.zeros(3))
    t[..., 2] += half_length * np.sign(np.round(t[..., 2], 9))
    # What crosses the equator was drawn out with its corners, those on it to neither side: both rims meet there.
    return middle + t


def rod_outside(p, radius, middle, half_length):
    d = p - middle
    d[:, 2] -= np.clip(d[:, 2], -half_length, half_length)
    return np.linalg.norm(d, axis=1) - radius


def write_stl(file, triangles):
    with open(file, "wb") as out:
        out.write(bytes(80) + np.uint32(len(triangles)).tobytes())
        records = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("end", "<u2")])
        records["corners"] = triangles
        out.write(records.tobytes())


def figures(gy, mm3, prescription):
    """By the volume of each dose, hottest first."""
    order = np.sort(gy)[::-1]
    cc = mm3 * 1e-3 * np.arange(1, len(order) + 1)

    def hottest(volume):
        return float(np.interp(volume, cc, order))

    return {"V100": 100 * np.mean(gy >= prescription), "V150": 100 * np.mean(gy >= 1.5 * prescription),
            "D90": hottest(0.9 * cc[-1]), "D10": hottest(0.1 * cc[-1]), "D30": hottest(0.3 * cc[-1]),
            "D2cc": hottest(2.0)}
