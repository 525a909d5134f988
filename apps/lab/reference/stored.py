"""What is kept of a reference solution, all of it small text:

  field.csv        x,y,z,dx,dy,dz: points in the gland, more than a needle radius from the needle, and their
                   displacements
                   from the finest level; errors are taken over these
  targets.csv      the same for 20 target points well inside the gland
  landmarks.csv    the same columns: what a model is given (`brachy deform --landmarks`)
  coarse.csv.gz    dx,dy,dz of the coarse level, rows of field.csv, then of targets.csv
  coarse.geo       the coarse mesh as gmsh is given it; with the deck's hash in convergence.csv
  convergence.csv  one row a level
  linearity.csv    (neo-Hookean scenes) how far the linear solution is off at each displacement
"""
import csv
import gzip
import io

import numpy as np
from scipy.stats import qmc

from scene import LANDMARK_COLUMNS, UserError

POINTS, TARGETS = 1500, 20
CONVERGENCE_COLUMNS = [
    "level",
    "needle_mm",
    "gland_mm",
    "nodes",
    "tets",
    "rel_l2_to_previous",
    "max_mm_to_previous",
    "cpu_s",
    "memory_mb",
    "deck_sha256",
]


def _gland_measure(points, scene):
    """Below 1 in the gland (n)."""
    return (((points - scene.centre) / scene.semi_axes) ** 2).sum(axis=1)


def evaluation_points(scene):
    """POINTS×3 in the gland and TARGETS×3 in the gland scaled by 0.85, all farther than a needle radius from the
    needle. One Halton sequence without scrambling: evenly spread, and the same on every machine."""
    unit = 2 * qmc.Halton(d=3, scramble=False).random(8 * POINTS)[1:] - 1
    # Written to 4 digits: the points are those written, so that a reader evaluates exactly there.
    points = np.round(scene.centre + unit * scene.semi_axes, 4)
    far = scene.needle_distance(points) > scene.radius
    in_gland = far & (_gland_measure(points, scene) < 0.9999)  # not on the capsule, where a digit decides the side
    field = points[in_gland][:POINTS]
    rest = points[in_gland][POINTS:]
    well_inside = _gland_measure(rest, scene) < 0.85**2
    targets = rest[well_inside][:TARGETS]
    if len(field) < POINTS or len(targets) < TARGETS:
        raise UserError(f"{scene.name}: too little gland is left around the needle for the evaluation points")
    return field, targets


def _write_vectors(file, positions, displacements):
    with open(file, "w") as out:
        out.write(LANDMARK_COLUMNS + "\n")
        for row in np.hstack([positions, displacements]):
            out.write(
                ",".join(f"{v:.4f}" for v in row[:3]) + "," + ",".join(f"{v + 0.0:.5f}" for v in row[3:]) + "\n"
            )


def _write_rows(file, columns, rows):
    with open(file, "w", newline="") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(columns)
        for row in rows:
            table.writerow([f"{v:.4g}" if isinstance(v, float) else v for v in (row[c] for c in columns)])


def write_landmarks(folder, scene):
    """landmarks.csv, to all digits: the tip of a contact lies on the capsule."""
    with open(folder / "landmarks.csv", "w") as out:
        out.write(LANDMARK_COLUMNS + "\n")
        out.writelines(",".join(f"{v + 0.0:.9g}" for v in row) + "\n" for row in scene.landmarks())


def write(folder, scene, points, split, finest, coarse, geo, rows, linearity):
    _write_vectors(folder / "field.csv", points[:split], finest[:split])
    _write_vectors(folder / "targets.csv", points[split:], finest[split:])
    write_landmarks(folder, scene)
    text = "dx,dy,dz\n" + "".join(",".join(f"{v + 0.0:.5f}" for v in row) + "\n" for row in coarse)
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb", mtime=0) as out:  # no time stamp: the same bytes every time
        out.write(text.encode())
    (folder / "coarse.csv.gz").write_bytes(packed.getvalue())
    (folder / "coarse.geo").write_text(geo)
    _write_rows(folder / "convergence.csv", CONVERGENCE_COLUMNS, rows)
    if linearity is not None:
        _write_rows(folder / "linearity.csv", list(linearity[0]), linearity)


def read(folder):
    """Points (field, then targets), how many are field, finest and coarse displacements."""
    try:
        field = np.loadtxt(folder / "field.csv", delimiter=",", skiprows=1)
        targets = np.loadtxt(folder / "targets.csv", delimiter=",", skiprows=1)
        coarse = np.loadtxt(folder / "coarse.csv.gz", delimiter=",", skiprows=1)
    except OSError as error:
        raise UserError(f"{folder.name}: nothing stored yet ({error}); run without --level first") from error
    both = np.vstack([field, targets])
    return both[:, :3], len(field), both[:, 3:], coarse


def read_convergence(folder):
    with open(folder / "convergence.csv", newline="") as table:
        return list(csv.DictReader(table))


def names(root, file):
    """The scenes that have this file, sorted, those of short_contacts behind the others; none of large_motion."""
    return [
        str(path.parent.relative_to(root))
        for pattern in ("*", "short_contacts/*")
        for path in sorted(root.glob(f"{pattern}/{file}"))
    ]


def write_table(root):
    """CONVERGENCE.md from every scene's convergence.csv and linearity.csv."""
    out = [
        "# Convergence of the reference scenes",
        "",
        "Written by `apps/lab/reference/run.py`. Difference: relative L2 over the points of field.csv between a "
        "level and",
        "the one before it, on the finer; at most: the largest of them. Time: ccx's processor time, one thread.",
        "",
        "| scene | level | h needle, mm | h gland, mm | nodes | difference | at most, mm | time, s | memory, MB |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    curves = []
    for name in names(root, "convergence.csv"):
        folder = root / name
        for row in read_convergence(folder):
            rel = f"{float(row['rel_l2_to_previous']):.2%}" if row["rel_l2_to_previous"] else "–"
            most = f"{float(row['max_mm_to_previous']):.3f}" if row["max_mm_to_previous"] else "–"
            out.append(
                f"| {name} | {row['level']} | {row['needle_mm']} | {row['gland_mm']} | {row['nodes']} | {rel} "
                f"| {most} | {float(row['cpu_s']):.0f} | {float(row['memory_mb']):.0f} |"
            )
        if (folder / "linearity.csv").is_file():
            with open(folder / "linearity.csv", newline="") as table:
                curves.append((name, list(csv.DictReader(table))))
    for name, rows in curves:
        out += [
            "",
            f"## Where linearity ends: {name}",
            "",
            "The linear solution on the same mesh against the neo-Hookean one.",
            "",
            "| needle moved, mm | relative L2 | at most, mm |",
            "|---|---|---|",
        ]
        out += [
            f"| {r['needle_displacement_mm']} | {float(r['rel_l2']):.1%} | {float(r['max_mm']):.3f} |" for r in rows
        ]
    (root / "CONVERGENCE.md").write_text("\n".join(out) + "\n")
