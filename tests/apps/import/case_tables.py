"""Scenes of meshes, and tables of seeds and poses, through the programs that read them: for import_cases.py."""
import json
import subprocess

import numpy as np
import pydicom

import case_files as files
import case_shapes as shapes_of

# Scenes of meshes.

def meshes(case):
    rng = case.rng
    at = rng.uniform(-60, 60, 3)
    case.shapes = {k: s for k, s in shapes_of.pelvis(rng, at, False).items() if k in ("prostate", "rectum", "bladder")}
    frame, units = case.pick("RAS", "LPS"), case.pick("mm", "m")
    case.truth = {}
    lines = ['name = "meshes"', "[box]", f"centre_mm = {at.round(1).tolist()}", "size_mm = [160, 160, 160]",
             "[template]", f"origin_mm = {(at - (30, 30, 80)).round(1).tolist()}"]
    for kind, shape in case.shapes.items():
        shape = shapes_of.Ellipsoid(shape.middle, shape.half, shape.turn)
        v, f = files.sphere_mesh(shape)
        case.truth[kind] = shapes_of.measured(v, f), v
        form = case.pick("stl", "STL text", "ply", "ply text", "ply big", "obj")
        # Where the file states its space, that counts.
        own = case.pick("", "", "SPACE=LPS", "SPACE=RAS")
        written = v * (files.LPS if (own[6:] or frame) == "LPS" else 1) * (1e-3 if units == "m" else 1)
        suffix = form.split()[0].lower()
        name = f"{kind}.{suffix.upper() if case.chance(0.3) else suffix}"
        files.write_mesh(case.folder / name, written, f, form, rng, own)
        if kind == "prostate":
            lines += ["[tissue]", f'mesh = "{name}"', f'frame = "{frame}"', f'units = "{units}"']
        else:
            lines += ["[[structure]]", f'name = "{kind}"', f'file = "{name}"']
    (case.folder / "scene.toml").write_text("\n".join(lines) + "\n")


def judge_meshes(case, out, program):
    scene = case.folder / "scene.toml"
    ended = subprocess.run([program, "inspect", scene, "--json", "--out", out.with_suffix(".ply")], capture_output=True,
                           text=True, check=False)
    if ended.returncode != 0:
        return [f"exit code {ended.returncode}: {ended.stderr[-400:].strip()}"]
    report, faults = json.loads(ended.stdout), []
    by_name = {s["name"]: s for s in report["structures"]}
    for name, ((cc, middle), v) in case.truth.items():
        s = by_name[name]
        off = np.linalg.norm(np.array(s["centroid_mm"]) - middle)
        box = np.abs(np.array(s["bbox_mm"]) - [v.min(0), v.max(0)]).max()
        if abs(s["volume_cc"] / cc - 1) > 0.01 or off > 0.1 or box > 0.1:
            faults.append(f"{name}: {s['volume_cc']:.3f} cc for {cc:.3f}, {off:.2f} mm off, box {box:.2f}")
    v, f = shapes_of.surface(out.with_suffix(".ply"))
    cc, middle = shapes_of.measured(v, f)
    (wanted, at), _ = case.truth["prostate"]
    if abs(cc / wanted - 1) > 0.01 or np.linalg.norm(middle - at) > 0.1:
        faults.append(f"--out: {cc:.3f} cc for {wanted:.3f}, at {middle}")
    if report["warnings"]:
        faults.append(f"WARNING: clean, with warnings {report['warnings']}")
    # Holes and outlines as others get them: the export's contours, by pydicom.
    dicom = out.with_name("dicom")
    ended = subprocess.run([program, "export", "--dicom", dicom, "--config", scene, "--slice-mm", "2"],
                           capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        return faults + [f"export: exit code {ended.returncode}: {ended.stderr[-400:].strip()}"]
    data = pydicom.dcmread(dicom / "rtstruct.dcm")
    names = {r.ROINumber: r.ROIName for r in data.StructureSetROISequence}
    for roi in data.ROIContourSequence:
        name = names[roi.ReferencedROINumber]
        points = files.LPS * np.concatenate([np.reshape(c.ContourData, (-1, 3)).astype(float)
                                             for c in roi.ContourSequence])
        (_, middle), v = case.truth[name]
        if np.abs(0.5 * (points.min(0) + points.max(0)) - 0.5 * (v.min(0) + v.max(0)))[:2].max() > 0.3:
            faults.append(f"export: {name} lies elsewhere")
    return faults


# Tables of seeds and poses.

def as_csv(rng, header, rows, digits=9):
    """A table as spreadsheets and trackers write it."""
    separator = [",", ", ", ",\t", " ,"][rng.integers(4)]
    quoted = rng.random() < 0.25
    end = "\r\n" if rng.random() < 0.4 else "\n"

    def cell(text):
        return f'"{text}"' if quoted else text
    lines = [separator.join(cell(h) for h in header)]
    lines += [separator.join(cell(f"{v:.{digits}g}") for v in row) for row in rows]
    if rng.random() < 0.3:
        lines.append("")
    text = end.join(lines) + (end if rng.random() < 0.8 else "")
    return (b"\xef\xbb\xbf" if rng.random() < 0.3 else b"") + text.encode()


def seeds_table(case):
    rng = case.rng
    number = int(rng.choice([6711, 200, 131]))
    case.source = {6711: "6711", 200: "theraseed-200", 131: "cs1-rev2"}[number]
    count = int(rng.integers(1, 40))
    axes = rng.normal(size=(count, 3))
    rows = np.column_stack([rng.uniform(-20, 20, (count, 3)), axes, np.full(count, number), rng.uniform(0.3, 1, count)])
    case.rows, case.points = np.round(rows, 6), rng.uniform(-30, 30, (20, 3)).round(4)
    (case.folder / "S.csv").write_bytes(as_csv(rng, "x,y,z,ax,ay,az,source,strength_u".split(","), case.rows))
    (case.folder / "P.csv").write_bytes(as_csv(rng, "x,y,z".split(","), case.points))


def judge_seeds_table(case, out, program):
    ended = subprocess.run([program, "dose", "--seeds", case.folder / "S.csv", "--points", case.folder / "P.csv",
                            "--out", out.with_suffix(".csv")], capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        return [f"exit code {ended.returncode}: {ended.stderr.strip()}"]
    table = np.loadtxt(out.with_suffix(".csv"), delimiter=",", skiprows=1, ndmin=2)
    source = case.sources[case.source]
    rate = sum(row[7] * source.rate(case.points, row[:3], row[3:6] / np.linalg.norm(row[3:6])) for row in case.rows)
    far = np.min([np.linalg.norm(case.points - row[:3], axis=1) for row in case.rows], axis=0) > 4
    off = np.abs(table[far, 3] / rate[far] - 1).max(initial=0)
    if np.abs(table[:, :3] - case.points).max() > 1e-6 or off > 0.01:
        return [f"dose rates are {100 * off:.2f} % off"]
    return []


def poses_table(case):
    """A straight needle at a speed, through an ellipsoid."""
    rng = case.rng
    case.count, case.speed = int(rng.integers(40, 200)), rng.uniform(2, 12)
    start, way = rng.uniform(-5, 5, 3) - (0, 0, 60), shapes_of.turned(rng.normal(size=3), rng.uniform(0, 0.2))
    t0 = float(rng.choice([0, 0, 100, 1.7e9]))
    dt = float(rng.choice([0.05, 0.1]))
    t = dt * np.arange(case.count)
    case.length = case.speed * t[-1]
    case.time = t[-1]
    # A turn about the shaft, of either sign of the quaternion.
    kind = case.pick("matrix", "w first", "w last")
    rows = []
    for s in t:
        R = way @ shapes_of.turned((0, 0, 1), 0.3 * s)
        p = start + case.speed * s * way[:, 2]
        if kind == "matrix":
            rows.append([t0 + s, *np.column_stack([R, p]).ravel()])
            continue
        x, y, z, w = files.quaternion_of(R) * (1 if rng.random() < 0.5 else -1)
        rows.append([t0 + s, *p, *((w, x, y, z) if kind == "w first" else (x, y, z, w))])
    header = {"matrix": ["t_s"] + [f"m{r}{c}" for r in range(3) for c in range(4)],
              "w first": "t_s,x,y,z,qw,qx,qy,qz".split(","), "w last": "t_s,x,y,z,qx,qy,qz,qw".split(",")}[kind]
    if case.chance(0.3):
        header, rows = header + ["button"], [[*row, 0] for row in rows]
    (case.folder / "T.csv").write_bytes(as_csv(rng, header, rows, 13))
    # How long the tip is inside the gland: an ellipsoid about the path's middle, cut analytically.
    case.gland = shapes_of.Ellipsoid(start + 0.5 * case.length * way[:, 2], rng.uniform(8, 20, 3))
    files.write_mesh(case.folder / "g.ply", *files.sphere_mesh(case.gland, 90, 120), "ply", rng)
    case.chord = 2 / np.sqrt(way[:, 2] @ case.gland.A @ way[:, 2])


def judge_poses_table(case, out, program):
    ended = subprocess.run([program, "metrics", case.folder / "T.csv", "--mesh", case.folder / "g.ply", "--json"],
                           capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        return [f"exit code {ended.returncode}: {ended.stderr.strip()}"]
    case.report = json.loads(ended.stdout)
    return judge_metrics(case)


def judge_metrics(case):
    r = case.report
    faults = []
    if abs(r["path_length_mm"] - case.length) > 0.1:
        faults.append(f"path {r['path_mm']} for {case.length:.3f}")
    if abs(r["elapsed_time_s"] - case.time) > 1e-3:
        faults.append(f"time {r['time_s']} for {case.time}")
    step = case.length / (case.count - 1)
    inside = min(case.chord, case.length)
    if abs(r["path_in_tissue_mm"] - inside) > step + 0.2:
        faults.append(f"in tissue {r['path_in_tissue_mm']} for {inside:.3f}")
    return faults
