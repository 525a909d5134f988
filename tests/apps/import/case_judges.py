"""Judges what `brachy import` wrote by numpy alone: for import_cases.py."""
import gzip
import json
import subprocess
import tomllib
import unicodedata

import numpy as np

import case_shapes as shapes_of
import hdr_plans

ROLES = {"left": "femoral_head", "right": "femoral_head"}


def voxels(path):
    """Header and values of an NRRD that `brachy import` wrote: steps (columns) and origin in RAS."""
    head, raw = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n")[1:] if ": " in line)
    flip = {"right-anterior-superior": (1, 1, 1), "left-posterior-superior": (-1, -1, 1)}[fields["space"]]

    def vectors(text):
        return np.array([[float(x) for x in v.strip("()").split(",")] for v in text.split()]) * flip
    if fields["encoding"].startswith("gz"):
        raw = gzip.decompress(raw)
    kind = {"float": "<f4", "double": "<f8", "short": "<i2", "unsigned char": "u1", "uint8": "u1"}[fields["type"]]
    size = [int(n) for n in fields["sizes"].split()]
    values = np.frombuffer(raw, kind, int(np.prod(size))).reshape(size, order="F")
    return values, vectors(fields["space directions"]).T, vectors(fields["space origin"])[0]


def judge_voxels(path, expected, what):
    values, steps, origin = voxels(path)
    points, wanted = expected
    at = np.linalg.solve(steps, (points - origin).T).T
    near = np.round(at).astype(int)
    off = np.linalg.norm((at - near) @ steps.T, axis=1).max()
    if off > 0.1:
        return [f"{what}: voxels are {off:.2f} mm beside their places"]
    if (near < 0).any() or (near >= values.shape).any():
        return [f"{what}: lies elsewhere: {near.min(0)} to {near.max(0)} of {values.shape}"]
    wrong = np.abs(values[tuple(near.T)] - wanted).max()
    if wrong > 2e-4 * np.abs(wanted).max():
        return [f"{what}: values are {wrong:.4g} off"]
    return []


def judge_structure(name, truth, report, path, is_small):
    faults = []
    role = ROLES.get(truth["role"], truth["role"])
    if report["role"] != role and not (name.startswith("hip_") and report["role"] == "other"):
        faults.append(f"{name!r} has the role {report['role']}, not {role}")
    v, f = shapes_of.surface(path)
    cc, middle = shapes_of.measured(v, f)
    # Where the heights of contours scatter, so do length and middle.
    jitter = truth.get("jitter", 0)
    share = 0.01 + (jitter / truth["extent"][2] if jitter else 0)
    # Voxels are few where a structure is small.
    least = 0 if "extent" in truth else 2e-4 if is_small else 0.02
    if abs(cc - truth["cc"]) > max(share * truth["cc"], least):
        faults.append(f"{name!r} has {cc:.4f} cc, not {truth['cc']:.4f}")
    off = np.linalg.norm(middle - truth["middle"])
    if off > 0.1 + 0.5 * jitter:
        faults.append(f"{name!r} lies {off:.3f} mm off, at {middle.round(2)}")
    if "extent" in truth and not is_small:
        extent = np.ptp(v @ truth["axes"], axis=0)
        # Of the heights the mean of what jitters.
        if (np.abs(extent - truth["extent"]) > (0.2, 0.2, 0.2 + 2 * jitter)).any():
            faults.append(f"{name!r} extends {extent.round(2)}, not {np.round(truth['extent'], 2)}")
    return [fault + f" ({truth['what']})" for fault in faults] if "what" in truth else faults


def judge_seeds(case, out):
    if not (out / "seeds.csv").exists():
        return ["no seeds.csv"]
    rows = np.loadtxt(out / "seeds.csv", delimiter=",", skiprows=1, ndmin=2)
    if rows.shape != case.seeds.shape:
        return [f"{len(rows)} seeds for {len(case.seeds)}"]
    off = np.abs(rows[:, :3] - case.seeds[:, :3]).max()
    turned = np.linalg.norm(np.cross(rows[:, 3:6], case.seeds[:, 3:6]), axis=1).max()
    if off > 1e-3 or turned > 1e-3 or np.abs(rows[:, 6:] - case.seeds[:, 6:]).max() > 1e-6:
        return [f"seeds are {off:.4f} mm and {turned:.4f} off, or of another source"]
    return []


def judge_template(case, out):
    """The seeds of plan.toml, by its holes, trains and planes."""
    if not (out / "plan.toml").exists():
        return ["no plan.toml"]
    scene, plan = (tomllib.loads((out / f).read_text()) for f in ("scene.toml", "plan.toml"))
    grid = scene["template"]
    x0, y0, z0 = grid["origin_mm"]
    found = []
    for needle in plan["needle"]:
        letter, row = needle["hole"][0], int(needle["hole"][1:])
        column = "ABCDEFGHIJKLMNOPQRSTUVWXYZ".index(letter)
        if grid.get("letters_from", "left") == "right":
            column = grid["columns"] - 1 - column
        if "rows_from" in grid:
            return []  # not of an import
        z = z0 + plan["base_plane_mm"] - needle.get("retraction_mm", 0)
        for part in needle["train"]:
            if part == "s":
                found.append([x0 + column * grid["spacing_mm"], y0 + (row - 1) * grid["spacing_mm"], z - 2.25])
            z -= 4.5 if part == "s" else 5.5
    wanted = case.seeds[:, :3]
    if len(found) != len(wanted):
        return [f"{len(found)} seeds of the plan for {len(wanted)}"]
    off = max(np.linalg.norm(np.array(found) - at, axis=1).min() for at in wanted)
    return [f"seeds of the plan are {off:.3f} mm off"] if off > 0.1 else []


def judge_patient(case, out, program):
    ended = subprocess.run([program, "import", str(case.folder), "--out", str(out), *case.options], capture_output=True,
                           text=True, check=False)
    lines = ended.stderr.strip().split("\n")
    if case.refused:
        is_right = ended.returncode == 2 and all(w in lines[-1] for w in case.refused) and not out.exists()
        return [] if is_right else [f"not refused with {case.refused}: {ended.returncode} {ended.stderr[-300:]}"]
    if ended.returncode != 0:
        return [f"exit code {ended.returncode}: {ended.stderr[-400:].strip()}"]
    faults = []
    report = json.loads((out / "import.json").read_text())
    by_name = {unicodedata.normalize("NFC", s["name_in_file"]): s for s in report["structures"]}
    for name, truth in case.structures.items():
        plain = unicodedata.normalize("NFC", name)
        if plain not in by_name:
            faults.append(f"{name!r} is missing; there are {sorted(by_name)}")
            continue
        s = by_name[plain]
        faults += judge_structure(name, truth, s, out / (s["name"] + ".ply"), case.warned == "in cm")
    for role in ("urethra", "rectum", "bladder"):
        wanted = sorted(unicodedata.normalize("NFC", n) for n, e in case.structures.items() if e["role"] == role)
        found = sorted(n for n, s in by_name.items() if s["role"] == role)
        if wanted != found:
            faults.append(f"the {role} is {found}, not {wanted}")
    if report["structures"][0]["role"] != "prostate" or report["structures"][0]["name"] != "prostate":
        faults.append("the gland is not first")
    if case.is_anatomy and bool(case.warned) != bool(report["warnings"]):
        faults.append(f"WARNING: {case.warned or 'clean'}, with warnings {report['warnings']}")
    if report["warnings"] and not ended.stdout.startswith("import: WARNING: "):
        faults.append("the warning is not at the top")
    if bool(report["volume"]) != case.is_image_taken:
        faults.append(f"image {case.is_image_taken}, volume {report['volume']}; left {report['left']}")
    elif case.image is not None:
        faults += judge_voxels(out / "volume.nrrd", case.image, "image")
    if bool(report["dose"]) != (case.dose is not None):
        faults.append(f"dose {case.dose is not None}, and {report['dose']}; {report['left']}")
    elif case.dose is not None:
        faults += judge_voxels(out / "dose.nrrd", case.dose, "dose")
    if case.seeds is not None:
        faults += judge_seeds(case, out)
    if case.template:
        faults += judge_template(case, out)
    if case.hdr:
        if (out / "plan.toml").exists():
            hdr_plans.judge_import(case.hdr, out, faults)
        else:
            faults.append("the HDR plan is missing")
    for words in case.left:
        if not any(line.startswith("import: left: ") and all(w in line for w in words) for line in lines):
            faults.append(f"no line says that {words} was left")
    return faults
