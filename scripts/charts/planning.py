#!/usr/bin/env python3
"""Makes and judges the plans of scripts/charts/planning.sh.   planning.py BRACHY FILE.json DIR [--quick]"""
import json
import os
import re
import resource
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

DRAWS, SD_MM, POINTS = 200, np.array([1.3, 1.5, 3.8]), 1500
STRENGTH_U, PRESCRIPTION_GY, SOLVER_S = 0.5, 145, 20
GLANDS = {
    "default phantom": {"size": [50, 40, 45]},
    "phantom 45 × 36 × 40": {"size": [45, 36, 40]},
    "phantom 50 × 30 × 45": {"size": [50, 30, 45]},
    "prostate_mr": {"mesh": "meshes/prostate_mr.ply"},
    "prostate_with_debris": {"mesh": "meshes/prostate_with_debris.stl"},
}
METHODS = {
    "rule": ["--method", "rule"],
    "annealing (default)": [],
    "annealing, robust": ["--robust"],
    "integer programme": ["--method", "integer"],
}
# name, structure, figure, scale, whether it is met
GOALS = [
    ("V100 %", "prostate", "V100", 1, lambda v: v >= 98), ("V150 %", "prostate", "V150", 1, lambda v: v <= 45),
    ("V200 %", "prostate", "V200", 1, lambda v: v < 20),
    ("UD30 %", "urethra", "D30", 100 / PRESCRIPTION_GY, lambda v: v <= 120),
    ("UD10 %", "urethra", "D10", 100 / PRESCRIPTION_GY, lambda v: v <= 130),
    ("RV100 cc", "rectum", "V100", 1, lambda v: v < 1),
]


def cylinder_stl(path, centre_xy, radius, z0, z1, around=32):
    """A closed straight cylinder along z, outward, as a binary STL."""
    angle = 2 * np.pi * np.arange(around) / around
    ring = np.c_[centre_xy[0] + radius * np.cos(angle), centre_xy[1] + radius * np.sin(angle)]
    low, high = (np.c_[ring, np.full(around, z)] for z in (z0, z1))
    ends = [np.array([*centre_xy, z]) for z in (z0, z1)]
    triangles = []
    for i in range(around):
        j = (i + 1) % around
        triangles += [(low[i], low[j], high[j]), (low[i], high[j], high[i]), (ends[0], low[j], low[i]),
                      (ends[1], high[i], high[j])]
    with open(path, "wb") as out:
        out.write(b"\0" * 80 + struct.pack("<I", len(triangles)))
        for t in triangles:
            out.write(struct.pack("<12fH", 0, 0, 0, *np.concatenate(t), 0))


def scene_of(gland, folder, brachy):
    """The gland's scene file. A mesh gets a urethra, a cylinder of 3 mm radius along z through the middle of its box,
    from 3 mm beyond each end, and a rectum, one of 13.5 mm radius whose front is 4 mm behind its back in the median
    plane, 15 mm longer at each end; the template is 20 mm in front of its apex, centred."""
    file = folder / "scene.toml"
    if "size" in gland:
        file.write_text(f"[tissue]\nphantom_size_mm = {gland['size']}\n")
        return file
    mesh = Path(os.environ["BRACHY_DATA_DIR"]) / gland["mesh"]
    said = subprocess.run([brachy, "inspect", mesh], check=True, capture_output=True, text=True).stdout
    box = re.search(r"from \(([^)]*)\) to \(([^)]*)\)", said)
    low, high = (np.array([float(v) for v in corner.split(",")]) for corner in box.groups())
    middle = (low + high) / 2
    cylinder_stl(folder / "urethra.stl", middle[:2], 3, low[2] - 3, high[2] + 3)
    cylinder_stl(folder / "rectum.stl", (middle[0], low[1] - 4 - 13.5), 13.5, low[2] - 15, high[2] + 15, 64)
    origin = [round(middle[0] - 30), round(middle[1] - 30), round(low[2] - 20)]
    file.write_text(f"[tissue]\nmesh = \"{mesh}\"\n[template]\norigin_mm = {origin}\n" + "".join(
        f"[[structure]]\nname = \"{name}\"\nfile = \"{name}.stl\"\n" for name in ("urethra", "rectum")))
    return file


def noisy_v100(brachy, scene, seeds_file, folder, draws, random):
    """V100 under each draw of the noise: the exact sum at random points of the gland."""
    rows = [line.split(",") for line in seeds_file.read_text().splitlines()[1:]]
    places = np.array([[float(v) for v in row[:3]] for row in rows])
    subprocess.run([brachy, "plan", "--generate", "--method", "rule", "--config", scene, "--force", "--structures",
                    folder / "structures"], check=True, capture_output=True)
    points = folder / "points.csv"
    np.savetxt(points, gland_points(folder / "structures" / "prostate.vtp", random), "%.4f", ",", header="x,y,z",
               comments="")
    shares = []
    for _ in range(draws):
        moved = places + random.normal(size=places.shape) * SD_MM
        noisy, out = folder / "noisy.csv", folder / "doses.csv"
        noisy.write_text("x,y,z,ax,ay,az,source,strength_u\n" + "".join(
            ",".join([f"{v:.4f}" for v in p] + row[3:]) + "\n" for p, row in zip(moved, rows)))
        subprocess.run([brachy, "dose", "--seeds", noisy, "--points", points, "--force", "--out", out], check=True,
                       capture_output=True)
        doses = np.loadtxt(out, delimiter=",", skiprows=1, usecols=4)
        shares.append(100 * np.mean(doses >= PRESCRIPTION_GY))
    return np.array(shares)


def gland_points(vtp, random):
    """Random points inside the closed surface of a .vtp as `brachy plan --structures` writes it: by the crossings of
    rays along z."""
    raw = vtp.read_bytes()
    counts = re.search(rb'NumberOfPoints="(\d+)".*?NumberOfPolys="(\d+)"', raw, re.S)
    vertices, polygons = (int(c) for c in counts.groups())
    offset = raw.index(b"\n_", raw.index(b"<AppendedData")) + 2
    blocks = []
    while len(blocks) < 2:
        size, = struct.unpack_from("<Q", raw, offset)
        blocks.append(raw[offset + 8:offset + 8 + size])
        offset += 8 + size
    xyz = np.frombuffer(blocks[0], "<f4").reshape(vertices, 3).astype(float)
    faces = np.frombuffer(blocks[1], "<i4" if len(blocks[1]) == 12 * polygons else "<i8").reshape(polygons, 3)
    a, b, c = (xyz[faces[:, k]] for k in range(3))
    low, high = xyz.min(0), xyz.max(0)
    inside = []
    while len(inside) < POINTS:
        p = low + random.random(3) * (high - low)
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((p[0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (p[1] - a[:, 1])) / area
            v = ((b[:, 0] - a[:, 0]) * (p[1] - a[:, 1]) - (p[0] - a[:, 0]) * (b[:, 1] - a[:, 1])) / area
            z = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
            crossed = (u >= 0) & (v >= 0) & (u + v <= 1) & (z > p[2])
        if np.count_nonzero(crossed) % 2:
            inside.append(p)
    return np.array(inside)


def made(brachy, scene, options, folder):
    """A plan's report, and the times that it took."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    seeds = folder / "seeds.csv"
    ended = subprocess.run([brachy, "plan", "--generate", "--config", scene, "--json", "--force", "--seeds", seeds,
                            *options], capture_output=True, text=True)
    wall, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if ended.returncode != 0:
        return {"refused": ended.stderr.strip().splitlines()[-1]}, seeds
    report = json.loads(ended.stdout)
    figures = {(f["structure"], f["name"]): f["value"] for f in report["figures"]}
    row = {name: figures[structure, figure] * scale for name, structure, figure, scale, _ in GOALS}
    return row | {"needles": report["needle_count"], "seeds": report["seed_count"],
                  "strength_u": report["air_kerma_strength_u"], "wall_s": wall,
                  "processor_s": after.ru_utime - before.ru_utime}, seeds


def table(rows):
    names = [goal[0] for goal in GOALS]
    lines = ["| gland | method | U a seed | needles | seeds | " + " | ".join(names) +
             " | V100 ≥ 95 % of draws | least | time, s | processor, s |", "|" + "---|" * (9 + len(names))]
    for r in rows:
        if "refused" in r:
            lines.append(f"| {r['gland']} | {r['method']} | {r['refused']} |")
            continue
        cells = [f"{r[name]:.2f}" if "cc" in name else f"{r[name]:.1f}" for name in names]
        cells = [c if goal[4](r[goal[0]]) else f"**{c}**" for c, goal in zip(cells, GOALS)]
        noise = [f"{r['robust_percent']:.0f} %", f"{r['least_v100']:.1f}"] if "robust_percent" in r else ["–", "–"]
        lines.append(" | ".join([f"| {r['gland']}", r["method"], f"{r['strength_u']:.3g}", str(r["needles"]),
                                 str(r["seeds"]), *cells, *noise, f"{r['wall_s']:.1f}",
                                 f"{r['processor_s']:.1f}"]) + " |")
    return "\n".join(lines) + "\n"


def write(rows, kept, charts, quick):
    kept.write_text(json.dumps({"strength_u": STRENGTH_U, "rows": rows}, indent=1) + "\n")
    text = f"""# Plans by every method

Of `scripts/charts/planning.sh`: {STRENGTH_U} U a seed (the rule chooses its own), {PRESCRIPTION_GY} Gy, exact dose on a
grid of 1 mm. Bold: misses its goal, which are V100 ≥ 98 %, V150 ≤ 45 %, V200 < 20 %, urethra D30 ≤ 120 % and
D10 ≤ 130 %, rectum V100 < 1 cc. Draws: {10 if quick else DRAWS} of placement noise, each seed by itself off by SD 1.3,
1.5 and 3.8 mm. The meshes' urethra and rectum are cylinders that the script states. The integer programme's solver,
CBC, has {SOLVER_S} s. Time: of a machine that had other work; processor: of all threads together.

{table(rows)}"""
    (charts / "planning.md").write_text(text)


def main():
    brachy, kept, charts = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    quick = "--quick" in sys.argv[4:]
    rows, random = [], np.random.default_rng(26)
    for name, gland in GLANDS.items():
        if "mesh" in gland and "BRACHY_DATA_DIR" not in os.environ:
            print(f"planning: {name} is left out; set BRACHY_DATA_DIR", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as made_in:
            folder = Path(made_in)
            scene = scene_of(gland, folder, brachy)
            for method, options in METHODS.items():
                strength = [] if method == "rule" else ["--strength-u", str(STRENGTH_U)]
                limit = ["--seconds", "10" if quick else str(SOLVER_S)] if "integer" in method else []
                row, seeds = made(brachy, scene, [*options, *strength, *limit], folder)
                if "refused" not in row and "annealing" in method:
                    shares = noisy_v100(brachy, scene, seeds, folder, 10 if quick else DRAWS, random)
                    row |= {"robust_percent": 100 * np.mean(shares >= 95), "least_v100": shares.min(),
                            "mean_v100": shares.mean()}
                rows.append({"gland": name, "method": method} | row)
                print(rows[-1], flush=True)
        write(rows, kept, charts, quick)
        if quick:
            break


if __name__ == "__main__":
    main()
