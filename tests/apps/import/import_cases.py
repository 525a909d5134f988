#!/usr/bin/python3
"""Whole cases of every kind of file that clinics have, drawn at random with analytic truth, through `brachy import` and
the programs that read meshes, seeds and trajectories; judged by numpy alone.

usage: import_cases.py BRACHY N [SEED [FIRST]]     BRACHY: the program `brachy`, beside brachy-import
prints a line for each fault, and shares; exits with 1 below 98 % of the valid cases whole, or below 98 % of the clean
ones without a warning, and where one that must be refused or warned of is not.

A case is a pelvis of ellipsoids and tubes (case_shapes.py) in files (case_files.py): contours, a DICOM segmentation or
label maps; beside them images, a dose, a plan, seeds, and files that are of no use here. Some are wrong on purpose:
mirrored, turned over, in centimetres, or with left and right exchanged, and must have a warning; some are ambiguous and
must be refused. Others are scenes of meshes, and tables of seeds and of poses. Truth: what slabs of the contours' own
areas hold, voxels summed by numpy, figures of the shapes: position to 0.1 mm, volume to 1 %, extent, role and side.
IMPORT_CASES_KEEP=FOLDER keeps the files of cases that fail.
"""
import json
import multiprocessing
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unicodedata

try:
    import numpy as np
    import pydicom
    import tomllib
except ImportError as missing:
    print(f"import_cases: {missing}; install python3-pydicom", file=sys.stderr)
    sys.exit(77)
sys.path += [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).resolve().parents[2] / "reference/dose")]
import case_files as files  # noqa: E402
import case_shapes as shapes_of  # noqa: E402
import hdr_plans  # noqa: E402
import make_odd_cases as odd  # noqa: E402
from tg43_numpy import Source  # noqa: E402

pydicom.config.settings.writing_validation_mode = pydicom.config.IGNORE
pydicom.config.settings.reading_validation_mode = pydicom.config.IGNORE
SOURCES = pathlib.Path(__file__).resolve().parents[3] / "config/sources"

NAMES = {
    "prostate": ["Prostate", "prostate", "PROSTATE", "Prostata", "próstata", "Prostaat", "gruczoł krokowy", "Stercz",
                 "Prostata klein", "Prostate_MR", "prostate 1", "Vorsteherdrüse", "Eturauhanen", "前列腺", "Προστάτης",
                 "Предстательная железа", "전립선", "前立腺", "Prostate (TRUS)", "1_Prostate", "Prostat", "Prostate-day0"],
    "urethra": ["Urethra_Prostatc", "Urethra", "URETHRA", "Harnröhre", "HARNROEHRE", "Urètre", "uretra", "Plasbuis",
                "Cewka moczowa", "Urinrör", "Močová trubice", "urethra1", "Urethra_Foley", "Uretra prostática",
                "Уретра", "ουρήθρα", "요도", "尿道", "Urethra (TRUS)", "Üretra"],
    "rectum": ["Rectum", "Rectum_Wall", "RECTUM", "Rektum", "Enddarm", "Mastdarm", "Retto", "Recto", "Reto",
               "Endeldarm", "Odbytnica", "Ändtarm", "Konečník", "rectum 2", "Rectum wall", "прямая кишка", "直腸", "직장",
               "Végbél", "Rectum-OAR"],
    "bladder": ["Bladder", "Bladder_Wall", "Harnblase", "Blase", "Vessie", "Vescica", "Vejiga", "Bexiga", "Blaas",
                "Pęcherz moczowy", "Urinblåsa", "Močový měchýř", "urinary_bladder", "Blasenwand", "Мочевой пузырь",
                "膀胱", "방광", "ουροδόχος κύστη", "Mesane", "Blære"],
    "penile_bulb": ["PenileBulb", "Bulbus penis", "Bulbe", "Bulbo peneano", "Penile_Bulb", "PENILE BULB"],
    "seminal_vesicles": ["SeminalVes", "Seminal_Vesicles", "Samenblasen", "Vésicules séminales", "SV", "Zaadblaasjes"],
}
LEFT_RIGHT = [("Femur_Head_L", "Femur_Head_R"), ("Hüftkopf links", "Hüftkopf rechts"),
              ("Femoral head left", "Femoral head right"), ("FEMORAL_HEAD_LT", "FEMORAL_HEAD_RT"),
              ("Testa femorale sinistra", "Testa femorale destra"), ("tête fémorale gauche", "tête fémorale droite"),
              ("Cabeza femoral izq", "Cabeza femoral der"), ("FemurHead_L", "FemurHead_R"), ("Heupkop li", "Heupkop re")]
TARGETS = ["PTV_Prostate", "PTV", "Ring prostate-PTV", "CTV", "Prostate+5mm", "prostate_expansion", "Rectum_PRV",
           "Urethra_PRV05", "zRectum", "100% isodose", "Rectum-PTV", "Prostatabett", "Avoid_Bladder", "PTV 145Gy",
           "CTV_Prostate", "Prostate PTV", "Dose 150[%]", "Bladder-Rectum", "Helper Prostate"]
TOTAL_SEGMENTATOR = {"prostate": "prostate", "urethra": "urethra", "rectum": "rectum", "bladder": "urinary_bladder",
                     "left": "hip_left", "right": "hip_right", "penile_bulb": "penile_bulb",
                     "seminal_vesicles": "seminal_vesicles"}
ROLES = {"left": "femoral_head", "right": "femoral_head"}
WARNED = ("mirrored", "turned over", "in cm", "sides exchanged")
CHARSETS = ["ISO_IR 100", "ISO_IR 101", "ISO_IR 144", "ISO_IR 126", "ISO_IR 192", "ISO_IR 148", "GB18030"]


def spelled(rng, name):
    """A name in another case, with other separators, or in decomposed letters, as it comes from a Macintosh."""
    way = rng.integers(10)
    if way == 5 and not name.isascii() and rng.random() < 0.5:
        name = unicodedata.normalize("NFD", name)
    elif way == 5 and name.isascii():
        name = "".join(chr(ord(c) + 0xfee0) if c.isalnum() else c for c in name)  # full-width letters
    elif way == 0 and name.upper().lower() == name.lower():
        name = name.upper()
    elif way == 1:
        name = name.replace(" ", "_")
    elif way == 2:
        name = name.replace("_", " ")
    elif way == 3:
        name = unicodedata.normalize("NFD", name)
    elif way == 4:
        name = name.replace(" ", "-") if "+" not in name else name
    return name


def charset_for(rng, names):
    """The character set in which all names can be written, perhaps none that is told."""
    able = []
    for charset in CHARSETS:
        codec = pydicom.charset.python_encoding[charset]
        try:
            "".join(names).encode(codec)
            able.append(charset)
        except UnicodeError:
            pass
    if all(n.isascii() for n in names) and rng.random() < 0.5:
        return None
    return str(rng.choice(able))


class Case:
    """What is in the folder, and what should come of it."""

    def __init__(self, number, seed, folder):
        self.rng, self.folder, self.number = np.random.default_rng([seed, number]), folder, number
        self.structures = {}  # in the file: role, cc, middle, jitter, extent, axes
        self.left = []  # words of one line each
        self.refused = self.warned = self.image = self.dose = self.seeds = self.hdr = self.template = None
        self.options, self.is_image_taken = [], False
        self.what = []

    def pick(self, *ways):
        way = ways[self.rng.integers(len(ways))]
        self.what.append(str(way))
        return way

    def chance(self, share):
        return bool(self.rng.random() < share)


# Patients.

def patient(case):
    rng = case.rng
    form = case.pick("rtstruct", "rtstruct", "rtstruct", "segmentation", "table", "folder", "one label", "dicom seg")
    case.warned = WARNED[rng.integers(4)] if case.chance(0.12) else None
    is_dicom = form in ("rtstruct", "dicom seg")
    plan = case.pick(None, None, "ldr", "post", "hdr") if is_dicom and not case.warned else None
    frame = case.pick("axial", "axial", "flipped", "tilted", "any") if form == "rtstruct" and not case.warned else "axial"
    if plan == "hdr":
        frame = "axial"
    R = shapes_of.slice_frame(rng, frame)
    is_axial = abs(R[2, 2]) > 0.95
    at = np.zeros(3) if plan == "hdr" else rng.uniform(-60, 60, 3) + rng.choice([0, 0, 400]) * rng.normal(size=3)
    shapes = shapes_of.pelvis(rng, at, is_axial)
    extra = [k for k in ("penile_bulb", "seminal_vesicles") if k in shapes and case.chance(0.4)]
    if case.chance(0.35) or case.warned == "sides exchanged":
        extra += ["left", "right"]
    shapes = {k: shapes[k] for k in ["prostate", "urethra", "rectum", "bladder", *extra]}
    pair = LEFT_RIGHT[rng.integers(len(LEFT_RIGHT))]
    names = {"left": pair[0], "right": pair[1]}
    for kind in shapes:
        names.setdefault(kind, str(rng.choice(NAMES.get(kind, ["?"]))))
    if case.warned == "sides exchanged":
        names["left"], names["right"] = names["right"], names["left"]
    names = {k: spelled(rng, n) for k, n in names.items()}
    transform = {"mirrored": lambda p: p * (-1, -1, 1), "turned over": lambda p: p * (1, 1, -1),
                 "in cm": lambda p: p * 0.1}.get(case.warned, lambda p: p)
    # As systems write them; damage of one kind in all files of a case.
    case.oddity = case.pick(*files.ODDITIES)
    if form == "rtstruct":
        draw_contours(case, shapes, names, transform, R, plan)
    else:
        draw_voxels(case, form, shapes, names, transform)
    if is_dicom:
        middle = shapes["prostate"].middle
        rtplan = draw_plan(case, plan, middle, shapes) if plan else None
        if case.chance(0.35) and not case.warned:
            case.dose = files.dose_file(case.folder / "RD.dcm", rng, middle, rtplan, case.oddity)
    if not case.refused:
        draw_unused(case, rtplan=plan is not None, has_frame=is_dicom, at=at, has_dose=case.dose is not None)


def draw_contours(case, shapes, names, transform, R, plan):
    rng = case.rng
    spacing = float(rng.choice([1.0, 1.25, 2.0, 2.5, 3.0]))
    if not abs(R[2, 2]) > 0.95:
        spacing = min(spacing, 1.25)
    ends = [s.heights(R) for s in shapes.values()]
    first = np.floor(min(e[0] for e in ends) / spacing) * spacing + rng.uniform(0, spacing)
    heights = np.arange(first, max(e[1] for e in ends), spacing)
    ways = {"jitter": float(rng.choice([0, 0, 0, 0.011, 0.03, 0.1 * spacing])), "twice": case.chance(0.2),
            "keyhole": case.chance(0.5)}
    if case.warned:
        ways["jitter"] = 0.0
    digits = int(rng.choice([2, 3, 4, 6])) if case.warned != "in cm" else 4
    drawn = {}
    for kind, shape in shapes.items():
        made = shapes_of.drawn(rng, shape, R, heights, ways)
        if made:
            drawn[names[kind]] = made[0]
            truth = made[1]
            truth["middle"] = transform(truth["middle"])
            truth["cc"] *= 1e-3 if case.warned == "in cm" else 1
            if case.warned:
                del truth["extent"]
                truth["jitter"] = 0
            case.structures[names[kind]] = {"role": kind, **truth}
    case.what.append(f"{spacing} mm {ways} {digits} digits")
    if not case.warned:
        for target in rng.choice(TARGETS, 3, replace=False):
            around = shapes_of.Ellipsoid(shapes["prostate"].middle, shapes["prostate"].half + rng.uniform(2, 6),
                                         shapes["prostate"].turn)
            made = shapes_of.drawn(rng, around, R, heights, ways | {"jitter": 0})
            drawn[str(target)] = made[0]
        if case.chance(0.06):
            # Two of the same words: neither is the one.
            double = shapes_of.Ellipsoid(shapes["prostate"].middle + (0, 0, 2), shapes["prostate"].half * 1.1)
            drawn.pop(names["prostate"])
            for name, shape in (("Prostate", shapes["prostate"]), ("Prostata", double)):
                drawn[name] = shapes_of.drawn(rng, shape, R, heights, ways)[0]
            case.refused = ["which structure is the prostate?", '"Prostate"', '"Prostata"', "--gland"]
    everything = list(drawn)
    rng.shuffle(everything)
    numbers = rng.permutation(np.arange(1, 3 * len(everything)))[:len(everything)]
    structures = [(int(n), name, [files.contour(transform(c), "CLOSED_PLANAR", digits) for c in drawn[name]])
                  for n, name in zip(numbers, everything)]
    add_odd_rois(case, structures, R, shapes["prostate"].middle, heights)
    if plan == "hdr":
        case.hdr = hdr_plans.Case(case.sources, 4 * case.number)
    charset = charset_for(rng, [name for _, name, _ in structures])
    case.what.append(str(charset))
    data = files.structure_set(structures, charset, [[int(c) for c in rng.integers(0, 256, 3)] for _ in structures])
    change_odd_rois(case, data)
    if charset is None and case.chance(0.3):
        data.SpecificCharacterSet = "ISO_IR 6"
    name = case.pick("RS.dcm", "RS1.2.840.113.dcm", "rtss", "sub/RS.DCM", "Structure Set.dcm")
    if "/" not in name and "." not in name and case.oddity.startswith("no meta"):
        name += ".dcm"
    files.save(data, case.folder / name, case.oddity)
    low = np.min([np.min(np.concatenate(c) @ R, 0) for c in drawn.values()], 0)
    high = np.max([np.max(np.concatenate(c) @ R, 0) for c in drawn.values()], 0)
    if not case.warned and case.chance(0.5):
        kind = case.pick("plain", "plain", "missing", "colour", "multi-frame", "8 bit", "12 bit", "12 bit signed",
                         "signed", "RLE")
        slices = np.concatenate([heights[0] - spacing * np.arange(3, 0, -1), heights,
                                 heights[-1] + spacing * np.arange(1, 4)])
        if case.chance(0.3):
            slices = slices[::-1]
            R = R * (1, 1, 1)
        case.image, left = files.image_series(case.folder / "images", rng, R, (low, high), slices, case.oddity, kind)
        if left:
            case.left.append(left)
        case.is_image_taken = case.image is not None


ODD_ROIS = ("point", "open", "empty", "bent", "flat", "other frame", "unknown number", "count", "no data")


def add_odd_rois(case, structures, R, middle, heights):
    """Structures that are of no use, and that stop nothing."""
    case.odd_rois = [str(k) for k in case.rng.choice(ODD_ROIS, case.rng.integers(0, 4), replace=False)]
    at = R.T @ middle
    ring = shapes_of.Ellipsoid(middle, (6, 6, 6)).section(R, at[2])
    flat = np.column_stack([ring, np.full(len(ring), at[2])]) @ R.T
    for n, kind in enumerate(case.odd_rois, 3 * len(structures) + 1):
        name = f"Odd {n}"
        bent = flat + np.outer(np.arange(len(flat)) % 7 == 3, 4 * R[:, 2])
        drawn = {"point": [files.contour(middle, "POINT")], "open": [files.contour(flat[:20], "OPEN_PLANAR")],
                 "empty": [], "bent": [files.contour(bent)], "other frame": [files.contour(flat)],
                 "flat": [files.contour(flat[[0, 5, 0]])], "unknown number": [files.contour(flat)]}.get(kind)
        if drawn is None:
            continue
        structures.append((n, name, drawn))
        case.left.append([str(7000 + n)] if kind == "unknown number" else [f"ROI {n}"])
    case.what.append(f"odd {case.odd_rois}")


def change_odd_rois(case, data):
    odd_at = {}
    kinds = [k for k in case.odd_rois if k not in ("count", "no data")]
    for kind, item, roi in zip(kinds, list(data.ROIContourSequence)[-len(kinds):] if kinds else [],
                               list(data.StructureSetROISequence)[-len(kinds):] if kinds else []):
        odd_at[kind] = item, roi
    if "other frame" in odd_at:
        odd_at["other frame"][1].ReferencedFrameOfReferenceUID = files.OTHER
    if "unknown number" in odd_at:
        odd_at["unknown number"][0].ReferencedROINumber += 7000
        case.left = [words for words in case.left if words != [f"ROI {odd_at['unknown number'][1].ROINumber}"]]
    first = data.ROIContourSequence[0].ContourSequence
    if "count" in case.odd_rois:
        first[0].NumberOfContourPoints += 1
    if "no data" in case.odd_rois:
        first.append(odd.item(ContourGeometricType="CLOSED_PLANAR", NumberOfContourPoints=0))


def draw_voxels(case, form, shapes, names, transform):
    rng, folder = case.rng, case.folder
    if form == "table" and case.warned != "sides exchanged":
        shapes = {k: v for k, v in shapes.items() if k not in ("left", "right")}
    spacing = rng.uniform(0.9, 1.7, 3) + (0.7 if "left" in shapes else 0)
    turn = shapes_of.turned(rng.normal(size=3), rng.uniform(0.05, 0.3)) if case.chance(0.25) else np.eye(3)
    shear = float(rng.uniform(-0.2, 0.2)) if case.chance(0.15) and form in ("segmentation", "table") else 0.0
    grid = shapes_of.Grid(shapes, spacing, rng, turn, shear)
    points = grid.points()
    labels = np.zeros(grid.size, int)
    values = {}
    for kind in sorted(shapes, key=lambda k: k == "urethra"):  # the urethra lies over the gland
        values[kind] = int(rng.integers(1, 12)) + 12 * len(values)
        labels[shapes[kind].holds(points)] = values[kind]
    for kind in shapes:
        truth = grid.truth(labels == values[kind])
        case.structures[names[kind]] = {"role": kind, **truth}
    moved = grid.moved(transform)
    for truth in case.structures.values():
        truth["middle"] = transform(truth["middle"])
        truth["cc"] *= 1e-3 if case.warned == "in cm" else 1
    dtype = str(rng.choice(["u1", "i2", "u2", "f4", "i4", "f8"]))
    by_file = {TOTAL_SEGMENTATOR.get(k, k): case.structures[names[k]] for k in shapes}
    if form == "segmentation":
        layered = case.chance(0.3)
        keys = [(f"Segment{n}_{k}", v) for n, kind in enumerate(shapes)
                for k, v in (("ID", f"s{n}"), ("Name", names[kind]), ("LabelValue", 1 if layered else values[kind]),
                             ("Layer", n if layered else 0), ("Color", "0.5 0.25 0.75"))]
        written = np.stack([labels == values[k] for k in shapes]) if layered else labels
        files.write_nrrd(folder / case.pick("Segmentation.seg.nrrd", "S.SEG.NRRD", "seg.nrrd"), moved, written, dtype, rng,
                         keys)
    elif form == "table":
        files.write_nifti(folder / case.pick("seg.nii.gz", "labels.nii", "SEG.NII.GZ"), moved, labels, dtype, rng,
                          {values[k]: names[k] for k in shapes})
    elif form == "dicom seg":
        files.segmentation(folder / "SEG.dcm", moved, labels, [values[k] for k in shapes], [names[k] for k in shapes],
                           case.oddity if case.oddity not in ("big endian",) else "plain")
    elif form == "folder":
        if case.warned == "sides exchanged":
            by_file["hip_left"], by_file["hip_right"] = by_file["hip_right"], by_file["hip_left"]
        case.structures = by_file
        other = {"left": "right", "right": "left"} if case.warned == "sides exchanged" else {}
        many = case.chance(0.5)
        for kind in shapes:
            write = [files.write_nifti, files.write_nrrd, files.write_mha][rng.integers(3)] if many else files.write_nifti
            ending = {files.write_nifti: ".nii.gz", files.write_nrrd: ".nrrd", files.write_mha: ".mha"}[write]
            file = TOTAL_SEGMENTATOR[other.get(kind, kind)]
            write(folder / (file + ending), moved, labels == values[kind], dtype, rng)
        files.write_nifti(folder / "spleen.nii.gz", moved, labels * 0, "u1", rng)
    else:
        gland = case.structures[names["prostate"]]
        case.structures = {"": gland}
        case.warned = "in cm" if case.warned == "in cm" else None
        write = [files.write_nrrd, files.write_mha, files.write_nifti][rng.integers(3)]
        write(folder / ("label" + {files.write_nrrd: ".nrrd", files.write_mha: ".mha", files.write_nifti: ".NII"}[write]),
              moved, labels == values["prostate"], dtype, rng)
    if case.chance(0.5) and form != "dicom seg":
        case.is_image_taken = True
        case.image = draw_image(case, moved)


def draw_image(case, grid):
    """Speckle, as echoes or a magnetic resonance image are; some with air around."""
    rng = case.rng
    values = rng.gamma(4, 20, grid.size)
    if case.chance(0.5):
        values[: grid.size[0] // 5] = 0
    kind = rng.integers(6)
    slope = 1.0
    if kind == 0:
        kept, dtype, write, name = values.clip(0, 255), "u1", files.write_nrrd, "image.nrrd"
    elif kind == 1:
        kept, dtype, write, name = values * 10 - 300, "i2", files.write_nrrd, "t2.NRRD"
    elif kind == 2:
        kept, dtype, write, name = values / 7, "f4", files.write_nrrd, "map.nrrd"
    elif kind == 3:
        kept, dtype, write, name = values.clip(0, 255), "u1", files.write_nifti, "image.nii.gz"
    elif kind == 4:
        kept, dtype, write, name, slope = values, "i2", files.write_nifti, "CT.NII", 0.5
    else:
        kept, dtype, write, name = values.clip(0, 255), "u1", files.write_mha, "us.mha"
    kept = kept.astype(dtype)
    write(case.folder / name, grid, kept, dtype, rng, **({"slope": slope} if slope != 1 else {}))
    pick = rng.integers(0, grid.size, (40, 3))
    return grid.origin + pick @ grid.steps.T, slope * kept[tuple(pick.T)].astype(float)


MODELS = {"I-125": (6711, "6711"), "Pd-103": (200, "200"), "Cs-131": (131, "CS-1 Rev2")}


def draw_plan(case, kind, middle, shapes):
    rng = case.rng
    if kind == "hdr":
        if case.hdr is None:
            case.hdr = hdr_plans.Case(case.sources, 4 * case.number)
        case.hdr.structures = "none"
        plan = case.hdr.plan()
        new = odd.new_set("RTPLAN", "hdr", case.number)
        for element in plan:
            new[element.tag] = element
        new.FrameOfReferenceUID = files.FRAME
        if not case.hdr.is_named:
            case.options += ["--source", case.hdr.source_name]
        files.save(new, case.folder / "RP.dcm", case.oddity if case.oddity != "UN sequence" else "plain")
        return new
    isotope = str(rng.choice(list(MODELS)))
    number, _ = MODELS[isotope]
    strength = float(rng.choice([0.4, 0.5, 0.65]))
    if kind == "ldr":
        # Needles along the patient's axis through holes 5 mm apart, trains of seeds and spacers.
        seeds = []
        holes = {tuple(h) for h in rng.integers(-3, 4, (12, 2))}
        for column, row in holes:
            tip = middle[2] + rng.uniform(5, 12)
            gaps = rng.integers(1, 3, int(rng.integers(1, 5)))
            z = tip - 2.25 - np.concatenate([[0], np.cumsum(4.5 + 5.5 * gaps)])
            seeds += [(1, np.array([middle[0] + 5 * column, middle[1] + 5 * row, h]), np.array([0, 0, 1.0])) for h in z]
        sources = [(isotope, strength)]
        case.template = True
    else:
        sources = [(isotope, strength), (isotope, 1.25 * strength)]
        # Wherever they came to lie; as many lie along no axis that a template has.
        seeds = [(int(rng.integers(1, 3)), middle + rng.uniform(-12, 12, 3), rng.normal(size=3) if n % 3 else None)
                 for n in range(int(rng.integers(20, 60)))]
        case.left.append(["RP.dcm", "seeds.csv"])
    plan = odd.implant([(s, at * files.LPS, None if axis is None else axis * files.LPS) for s, at, axis in seeds], sources)
    axes = [(0, 0, 1) if axis is None else axis / np.linalg.norm(axis) for _, _, axis in seeds]
    case.seeds = np.array([[*at, *axis, number, sources[s - 1][1]] for (s, at, _), axis in zip(seeds, axes)])
    files.save(plan, case.folder / "RP.dcm", case.oddity)
    return plan


UNUSED = ("second plan", "external", "localizer", "capture", "registration", "report", "presentation", "text", "picture",
          "empty", "second dose", "dose elsewhere", "relative dose", "parametric map", "hidden", "pdf", "dicomdir",
          "second series elsewhere", "treatment record", "not numbers")


def draw_unused(case, rtplan, has_frame, at, has_dose):
    rng, folder = case.rng, case.folder
    for kind in rng.choice(UNUSED, rng.integers(0, 4), replace=False):
        name = f"x{kind.replace(' ', '_')}.dcm"
        case.what.append(f"beside: {kind}")
        seed = odd.implant([(1, (at + (1, 2, 3)) * files.LPS, None)], [("I-125", 0.5)])
        if kind == "second plan" and rtplan and case.seeds is not None:
            seed.SOPInstanceUID += ".1"
            files.save(seed, folder / name)
            case.left.append([name, "another plan"])
        elif kind == "external" and has_frame:
            data = odd.new_set("RTPLAN", "external", case.number)
            data.BeamSequence = pydicom.Sequence([odd.item(BeamNumber=1, BeamName="AP", TreatmentMachineName="Linac")])
            data.FrameOfReferenceUID, data.RTPlanLabel = files.FRAME, "EBRT"
            files.save(data, folder / name)
            case.left.append([name])
        elif kind == "localizer":
            data = odd.new_set("CT", "localizer", case.number)
            data.ImageType = ["ORIGINAL", "PRIMARY", "LOCALIZER"]
            data.SeriesInstanceUID, data.FrameOfReferenceUID = odd.generate_uid(entropy_srcs=["loc"]), files.FRAME
            files.place(data, np.array([[-1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), at, (1, 1))
            files.pixels(data, np.arange(1200).reshape(30, 40), 16)
            files.save(data, folder / name)
            case.left.append([name])
        elif kind in ("capture", "registration", "report", "presentation", "treatment record"):
            modality = {"capture": "OT", "registration": "REG", "report": "SR", "presentation": "PR",
                        "treatment record": "RTRECORD"}[kind]
            odd.CLASSES.setdefault(modality, "1.2.840.10008.5.1.4.1.1.481.6")
            data = odd.new_set(modality, kind, case.number)
            files.save(data, folder / name)
            case.left.append([name])
        elif kind in ("text", "picture", "empty", "pdf", "not numbers"):
            name = {"text": "README.txt", "picture": "screen.PNG", "empty": "empty.dcm", "pdf": "report.pdf",
                    "not numbers": "notes.csv"}[kind]
            content = {"text": b"Exported by a system.\n", "picture": b"\x89PNG\r\n\x1a\n" + bytes(200), "empty": b"",
                       "pdf": b"%PDF-1.4\n", "not numbers": b"a,b\n1,2\n"}[kind]
            (folder / name).write_bytes(content)
            case.left.append([name])
        elif kind == "second dose" and has_dose and has_frame:
            files.dose_file(folder / ("zz" + name), rng, at)
            case.left.append(["zz" + name])
        elif kind == "dose elsewhere" and has_frame:
            files.dose_file(folder / name, rng, at)
            data = pydicom.dcmread(folder / name)
            data.FrameOfReferenceUID = files.OTHER
            data.save_as(folder / name)
            case.left.append([name])
        elif kind == "relative dose" and has_dose:
            files.dose_file(folder / name, rng, at)
            data = pydicom.dcmread(folder / name)
            data.DoseUnits = "RELATIVE"
            data.save_as(folder / name)
            case.left.append([name])
        elif kind == "parametric map" and case.is_image_taken:
            grid = shapes_of.Grid({"a": shapes_of.Ellipsoid(at, (15, 15, 15))}, (2, 2, 2), rng)
            files.write_nrrd(folder / "zADC map.nrrd", grid, rng.gamma(4, 0.3, grid.size), "f4", rng)
            case.left.append(["zADC map.nrrd"])
        elif kind == "hidden":
            (folder / ".DS_Store").write_bytes(b"\0\0\0\1Bud1")
        elif kind == "dicomdir":
            data = odd.new_set("OT", "dir", case.number)
            del data.Modality
            data.SOPClassUID = data.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.1.3.10"
            data.FileSetID = "STUDY"
            files.save(data, folder / "DICOMDIR")
            case.left.append(["DICOMDIR"])
        elif kind == "second series elsewhere" and case.image is not None and has_frame:
            for n in range(3):
                data = odd.new_set("MR", "far", case.number, n)
                data.SeriesInstanceUID, data.FrameOfReferenceUID = odd.generate_uid(entropy_srcs=["far"]), files.OTHER
                files.place(data, np.diag([-1.0, -1, 1]), at + (0, 0, n), (1, 1))
                files.pixels(data, np.arange(1200).reshape(30, 40), 16)
                files.save(data, folder / f"far{n}.dcm")
            case.left.append(["far", "frame of reference"])


def voxels(path):
    """Header and values of an NRRD that `brachy import` wrote: steps (columns) and origin in RAS."""
    head, raw = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().split("\n")[1:] if ": " in line)
    flip = {"right-anterior-superior": (1, 1, 1), "left-posterior-superior": (-1, -1, 1)}[fields["space"]]

    def vectors(text):
        return np.array([[float(x) for x in v.strip("()").split(",")] for v in text.split()]) * flip
    if fields["encoding"].startswith("gz"):
        import gzip
        raw = gzip.decompress(raw)
    kind = {"float": "<f4", "double": "<f8", "short": "<i2", "unsigned char": "u1", "uint8": "u1"}[fields["type"]]
    size = [int(n) for n in fields["sizes"].split()]
    return (np.frombuffer(raw, kind, int(np.prod(size))).reshape(size, order="F"), vectors(fields["space directions"]).T,
            vectors(fields["space origin"])[0])


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
    if abs(cc - truth["cc"]) > max(share * truth["cc"], 2e-4 if is_small else 0.02):
        faults.append(f"{name!r} has {cc:.4f} cc, not {truth['cc']:.4f}")
    off = np.linalg.norm(middle - truth["middle"])
    if off > 0.1 + 0.5 * jitter:
        faults.append(f"{name!r} lies {off:.3f} mm off, at {middle.round(2)}")
    if "extent" in truth and not is_small:
        extent = np.ptp(v @ truth["axes"], axis=0)
        # Of the heights the mean of what jitters.
        if (np.abs(extent - truth["extent"]) > (0.2, 0.2, 0.2 + 2 * jitter)).any():
            faults.append(f"{name!r} extends {extent.round(2)}, not {np.round(truth['extent'], 2)}")
    return faults


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
    if bool(case.warned) != bool(report["warnings"]):
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
        points = np.concatenate([np.reshape(c.ContourData, (-1, 3)).astype(float) for c in roi.ContourSequence]) * files.LPS
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
    ended = subprocess.run([program, "dose", "--seeds", case.folder / "S.csv", "--points", case.folder / "P.csv", "--out",
                            out.with_suffix(".csv")], capture_output=True, text=True, check=False)
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


KINDS = [(patient, judge_patient)] * 8 + [(meshes, judge_meshes), (seeds_table, judge_seeds_table),
                                         (poses_table, judge_poses_table)]


def run(task):
    program, number, seed, sources = task
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        (work / "in").mkdir()
        case = Case(number, seed, work / "in")
        case.sources = sources
        make, judge = KINDS[number % len(KINDS)]
        case.what.append(make.__name__)
        make(case)
        try:
            faults = judge(case, work / "out", program)
        except (KeyError, ValueError, OSError, IndexError) as e:
            faults = [f"cannot be judged: {type(e).__name__}: {e}"]
        keep = os.environ.get("IMPORT_CASES_KEEP")
        if keep and faults:
            shutil.copytree(work, pathlib.Path(keep) / str(number), dirs_exist_ok=True)
    kind = "refused" if case.refused else "warned" if case.warned else "clean"
    return number, kind, faults, " | ".join(case.what)


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    count = int(sys.argv[2])
    seed, first = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((3, 1), (4, 0)))
    sources = {file.stem: Source(file) for file in SOURCES.glob("*.toml")}
    tasks = [(program, number, seed, sources) for number in range(first, first + count)]
    all_of = {"clean": 0, "warned": 0, "refused": 0}
    whole = dict(all_of)
    unwarned = 0
    with multiprocessing.Pool(min(os.cpu_count(), count)) as pool:
        for number, kind, faults, what in pool.imap(run, tasks):
            for fault in faults:
                print(f"case {number} ({what}): {fault}", flush=True)
            all_of[kind] += 1
            whole[kind] += not faults
            unwarned += kind == "clean" and not any(f.startswith("WARNING") for f in faults)
    print(f"import_cases: of {count} cases {all_of['clean']} are clean: {whole['clean']} are whole, {unwarned} without a "
          f"warning; {whole['warned']} of {all_of['warned']} wrong ones are warned of, {whole['refused']} of "
          f"{all_of['refused']} ambiguous ones refused")
    least = 0.98 * all_of["clean"]
    return int(whole["clean"] < least or unwarned < least or whole["warned"] < all_of["warned"]
               or whole["refused"] < all_of["refused"])


if __name__ == "__main__":
    sys.exit(main())
