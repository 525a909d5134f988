#!/usr/bin/env python3
"""Checks `brachy dose` against TG-43U1 in numpy, written from the protocol and not from the program.

    /usr/bin/python3 tests/reference/dose/tg43_check.py build/release/bin/brachy [--source FILE]

100 orientations, 100 points about a source in each, 0.6 to 80 mm from it, outside its capsule: rates agree to 1e-9.
Prints the largest difference; exit code 1 where it is larger.

Equation 1 of Rivard et al., Med. Phys. 31 (2004) 633-674, line source; g log-linear and F bilinear between nodes, both
nearest or continued beyond them as in TG-43U1S1 (Med. Phys. 34, 2007, 2187-2205).
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import numpy as np

ORIENTATIONS, POINTS = 100, 100
MOST = 1e-9


def dose_rate_per_u(source, along_cm, away_cm):
    """cGy/h/U at points along and away from the source's middle."""
    length = source["active_length_cm"]

    def geometry(z, rho):  # equation 4: the angle between the lines to both ends of the active length
        return (np.arctan2(z + length / 2, rho) - np.arctan2(z - length / 2, rho)) / (length * rho)

    r = np.hypot(along_cm, away_cm)
    theta = np.degrees(np.arccos(np.clip(along_cm / r, -1, 1)))
    nodes, g = np.array(source["g"]["r_cm"]), np.array(source["g"]["values"])
    log_g = np.interp(r, nodes, np.log(g))
    slope = np.log(g[-1] / g[-2]) / (nodes[-1] - nodes[-2])
    log_g = np.where(r > nodes[-1], np.log(g[-1]) + slope * (r - nodes[-1]), log_g)
    f_r, f_theta, table = (np.array(source["F"][key]) for key in ("r_cm", "theta_deg", "values"))
    if f_theta[-1] == 90:
        theta = np.minimum(theta, 180 - theta)
    by_angle = np.array([np.interp(r, f_r[~np.isnan(row)], row[~np.isnan(row)]) for row in table])
    anisotropy = np.array([np.interp(t, f_theta, column) for t, column in zip(theta, by_angle.T)])
    reference = geometry(0.0, 1.0)
    return source["dose_rate_constant"] * geometry(along_cm, away_cm) / reference * np.exp(log_g) * anisotropy


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = pathlib.Path(__file__).resolve().parents[3]
    parser.add_argument("brachy", type=pathlib.Path)
    parser.add_argument("--source", type=pathlib.Path, default=root / "config/sources/mhdr-v2.toml")
    options = parser.parse_args()
    source = tomllib.loads(options.source.read_text())
    random = np.random.default_rng(43)
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for _ in range(ORIENTATIONS):
            axis = random.normal(size=3)
            axis /= np.linalg.norm(axis)
            middle = random.uniform(-30, 30, 3)
            points = np.empty((0, 3))
            while len(points) < POINTS:
                way = random.normal(size=(POINTS, 3))
                way *= (np.exp(random.uniform(np.log(0.6), np.log(80), POINTS)) / np.linalg.norm(way, axis=1))[:, None]
                along, away = way @ axis, np.linalg.norm(np.cross(axis, way), axis=1)
                outside = (np.abs(along) > source["capsule_length_mm"] / 2) | (away > source["capsule_diameter_mm"] / 2)
                points = np.vstack([points, way[outside & (away > 1e-3)]])[:POINTS]
            strength = random.uniform(0.1, 5e4)
            seed = [*middle, *axis, source["number"], strength]
            np.savetxt(folder / "s.csv", [seed], "%.17g", ",", header="x,y,z,ax,ay,az,source,strength_u", comments="")
            np.savetxt(folder / "p.csv", middle + points, "%.17g", ",", header="x,y,z", comments="")
            subprocess.run([options.brachy, "dose", "--force", "--seeds", folder / "s.csv", "--points",
                            folder / "p.csv", "--out", folder / "o.csv"], check=True, stdout=subprocess.DEVNULL)
            seen = np.loadtxt(folder / "o.csv", delimiter=",", skiprows=1)
            way = seen[:, :3] - middle
            along, away = way @ axis, np.linalg.norm(np.cross(axis, way), axis=1)
            expected = strength * dose_rate_per_u(source, along / 10, away / 10)
            worst = max(worst, np.max(np.abs(seen[:, 3] / expected - 1)))
    print(f"{source['name']}: {ORIENTATIONS * POINTS} points in {ORIENTATIONS} orientations, "
          f"largest difference {worst:.1e}")
    if not worst <= MOST:
        sys.exit(f"more than {MOST:g}")


if __name__ == "__main__":
    main()
