#!/usr/bin/python3
"""Imports generated pelvises with analytic truth, and judges what `brachy import` wrote by an independent reading.

usage: anatomy_cases.py BRACHY_IMPORT [COUNT [FIRST]]     default: 24 cases from number 0; exits with 1 if any is wrong

Each case draws shapes (ellipsoids and cylinders), names (TG-263's and clinics' in a dozen languages, with digits, case,
separators, accents, among targets and planning aids), a form (RTSTRUCT, segmentation, label map with a table, a folder
with a file an organ; NRRD, NIfTI or MetaImage; any axes and signs, LPS or RAS, element types) and perhaps an image
beside it. Some are wrong on purpose: mirrored, turned over, in centimetres, or with left and right exchanged, and must
have a warning; some are ambiguous and must be refused. Truth: slabs of the shapes' sections for contours, and the
voxels themselves, summed by numpy, for label maps: centroid to 0.1 mm, volume to 1 % (at least 20 mm³), role and side.
"""
import gzip
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

try:
    import numpy as np
    import pydicom
except ImportError as missing:
    print(f"anatomy_cases: {missing}; install python3-pydicom", file=sys.stderr)
    sys.exit(77)

NAMES = {
    "prostate": ["Prostate", "prostate", "PROSTATE", "Prostata", "próstata", "Prostaat", "gruczoł krokowy", "Stercz",
                 "Prostata klein", "Prostate_MR", "prostate 1", "Vorsteherdrüse", "Eturauhanen", "前列腺", "Προστάτης"],
    "urethra": ["Urethra_Prostatc", "Urethra", "URETHRA", "Harnröhre", "HARNROEHRE", "Urètre", "uretra", "Plasbuis",
                "Cewka moczowa", "Urinrör", "Močová trubice", "urethra1", "Urethra_Foley", "Uretra prostática"],
    "rectum": ["Rectum", "Rectum_Wall", "RECTUM", "Rektum", "Enddarm", "Mastdarm", "Retto", "Recto", "Reto",
               "Endeldarm",
               "Odbytnica", "Ändtarm", "Konečník", "rectum 2", "Rectum wall", "прямая кишка"],
    "bladder": ["Bladder", "Bladder_Wall", "Harnblase", "Blase", "Vessie", "Vescica", "Vejiga", "Bexiga", "Blaas",
                "Pęcherz moczowy", "Urinblåsa", "Močový měchýř", "urinary_bladder", "Blasenwand"],
    "penile_bulb": ["PenileBulb", "Bulbus penis", "Bulbe", "Bulbo peneano"],
}
LEFT_RIGHT = [("Femur_Head_L", "Femur_Head_R"), ("Hüftkopf links", "Hüftkopf rechts"), 
              ("Femoral head left", "Femoral head right"),
              ("Testa femorale sinistra", "Testa femorale destra"), ("tête fémorale gauche", "tête fémorale droite"),
              ("Cabeza femoral izq", "Cabeza femoral der"), ("FemurHead_L", "FemurHead_R"),
              ("Heupkop li", "Heupkop re")]
TARGETS = ["PTV_Prostate", "PTV", "Ring prostate-PTV", "CTV", "Prostate+5mm", "prostate_expansion", "Rectum_PRV",
           "Urethra_PRV05",
           "zRectum", "100% isodose", "Rectum-PTV", "Prostatabett", "Avoid_Bladder"]
TOTAL_SEGMENTATOR = {"prostate": "prostate", "urethra": "urethra", "rectum": "rectum", "bladder": "urinary_bladder",
                     "left": "hip_left", "right": "hip_right"}


class Ellipsoid:
    def __init__(self, middle, half):
        self.middle, self.half = np.array(middle, float), np.array(half, float)

    def box(self):
        return self.middle - self.half, self.middle + self.half

    def holds(self, x):
        return (((x - self.middle) / self.half) ** 2).sum(-1) <= 1

    def section(self, z):
        t = (z - self.middle[2]) / self.half[2]
        return None if abs(t) >= 1 else self.half[:2] * np.sqrt(1 - t * t)


class Cylinder(Ellipsoid):
    def holds(self, x):
        d = (x - self.middle) / self.half
        return ((d[..., :2] ** 2).sum(-1) <= 1) & (abs(d[..., 2]) <= 1)

    def section(self, z):
        return None if abs(z - self.middle[2]) > self.half[2] else self.half[:2]


def anatomy(random):
    """Shapes in RAS by what they are."""
    at = random.uniform(-60, 60, 3)
    half = random.uniform((17, 13, 15), (28, 22, 26))
    gap = random.uniform(2, 6)
    rectum = np.array([random.uniform(11, 17), random.uniform(10, 16), half[2] + random.uniform(6, 18)])
    bladder = random.uniform((25, 22, 18), (45, 35, 35))
    bulb = random.uniform((7, 5, 6), (10, 8, 9))
    head = random.uniform(20, 25)
    return {
        "prostate": Ellipsoid(at, half),
        "urethra": Cylinder(at + (0, random.uniform(-2, 3), 0), (3.2, 3.2, half[2] + 5)),
        "rectum": Cylinder(at + (random.uniform(-3, 3), -half[1] - gap - rectum[1], 0), rectum),
        "bladder": Ellipsoid(at + (0, random.uniform(-3, 8), half[2] + bladder[2] + 1), bladder),
        "penile_bulb": Ellipsoid(at + (0, -half[1] / 2, -half[2] - bulb[2] - 8), bulb),
        "left": Ellipsoid(at + (-random.uniform(85, 95), 5, 10), (head, head, head)),
        "right": Ellipsoid(at + (random.uniform(85, 95), 5, 10), (head, head, head)),
    }


def chosen_names(random, kinds):
    pair = LEFT_RIGHT[random.integers(len(LEFT_RIGHT))]
    sides = {"left": pair[0], "right": pair[1]}
    return {kind: sides.get(kind) or NAMES[kind][random.integers(len(NAMES[kind]))] for kind in kinds}


def write_rtstruct(file, shapes, names, transform, slice_mm, random):
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.uid import ExplicitVRLittleEndian, generate_uid
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.481.3"
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data = Dataset()
    data.file_meta = meta
    data.SpecificCharacterSet = "ISO_IR 192"
    data.SOPClassUID, data.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
    data.Modality = "RTSTRUCT"
    frame, truth = generate_uid(), {}
    data.StructureSetROISequence, data.ROIContourSequence = pydicom.Sequence(), pydicom.Sequence()
    for number, kind in enumerate(shapes, 1):
        roi = Dataset()
        roi.ROINumber, roi.ROIName, roi.ReferencedFrameOfReferenceUID = number, names[kind], frame
        data.StructureSetROISequence.append(roi)
        contours = Dataset()
        contours.ReferencedROINumber, contours.ContourSequence = number, pydicom.Sequence()
        shape = shapes[kind]
        # What the contours themselves hold, a slab for each.
        weights, middles = [], []
        low, high = shape.box()
        heights = np.arange(np.floor(low[2] / slice_mm), np.ceil(high[2] / slice_mm) + 1) * slice_mm + 0.5 * slice_mm
        for z in heights:
            half = shape.section(z)
            if half is None or half.min() < 0.3:
                continue
            angle = np.linspace(0, 2 * np.pi, 96, endpoint=False) + random.uniform(0, 6)
            # A polygon of the ellipse's own area.
            grown = np.sqrt(np.pi / (48 * np.sin(2 * np.pi / 96)))
            ring = np.column_stack([shape.middle[0] + grown * half[0] * np.cos(angle),
                                    shape.middle[1] + grown * half[1] * np.sin(angle), np.full(96, z)])
            ring = transform(ring)
            weights.append(np.pi * half.prod() * slice_mm)
            middles.append([*shape.middle[:2], z])
            contour = Dataset()
            contour.ContourGeometricType, contour.NumberOfContourPoints = "CLOSED_PLANAR", len(ring)
            contour.ContourData = [f"{v:.4f}" for v in (ring * (-1, -1, 1)).ravel()]
            contours.ContourSequence.append(contour)
        data.ROIContourSequence.append(contours)
        truth[kind] = transform(np.average(middles, 0, weights)), sum(weights) / 1000
    data.is_little_endian, data.is_implicit_VR = True, False
    data.save_as(str(file), write_like_original=False)
    return truth


class Grid:
    """A grid about the shapes, its axes any of RAS's with any signs."""

    def __init__(self, shapes, spacing, random, margin=6):
        low = np.min([s.box()[0] for s in shapes.values()], 0) - margin
        high = np.max([s.box()[1] for s in shapes.values()], 0) + margin
        order, signs = random.permutation(3), random.choice([-1, 1], 3)
        self.size = np.zeros(3, int)
        self.steps = np.zeros((3, 3))
        self.origin = np.array(low, float)
        for a, world in enumerate(order):
            self.size[a] = int(np.ceil((high[world] - low[world]) / spacing[world])) + 1
            self.steps[world, a] = signs[a] * spacing[world]
            if signs[a] < 0:
                self.origin[world] = low[world] + (self.size[a] - 1) * spacing[world]
        indices = np.stack(np.meshgrid(*(np.arange(n) for n in self.size), indexing="ij"), -1)
        self.points = self.origin + indices @ self.steps.T

    def truth(self, mask):
        count = mask.sum()
        return self.points[mask].mean(0), count * abs(np.linalg.det(self.steps)) / 1000


def voxel_bytes(values, dtype):
    return np.asfortranarray(values.astype(dtype)).tobytes("F")


def write_nrrd(file, grid, values, dtype, random, keys=()):
    types = {"u1": "uint8", "i2": "short", "u2": "ushort", "i4": "int", "f4": "float", "f8": "double"}
    lps = random.random() < 0.5
    flip = np.array([-1, -1, 1]) if lps else np.array([1, 1, 1])
    vector = lambda v: "(" + ",".join(repr(float(x)) for x in v * flip) + ")"
    data = voxel_bytes(values, "<" + dtype)
    coded = random.random() < 0.5
    header = [f"type: {types[dtype]}", "dimension: 3", "sizes: " + " ".join(str(n) for n in grid.size),
              "space: " + ("left-posterior-superior" if lps else "right-anterior-superior"),
              "space directions: " + " ".join(vector(grid.steps[:, a]) for a in range(3)),
              "space origin: " + vector(grid.origin), "kinds: domain domain domain", "endian: little",
              "encoding: " + ("gzip" if coded else "raw")]
    text = "NRRD0004\n" + "\n".join(header) + "\n" + "".join(f"{k}:={v}\n" for k, v in keys) + "\n"
    file.write_bytes(text.encode() + (gzip.compress(data, 1) if coded else data))


def write_nifti(file, grid, values, dtype, random, table=None, slope=0.0, intent=0):
    codes = {"u1": 2, "i2": 4, "i4": 8, "f4": 16, "f8": 64, "u2": 512}
    extension = b""
    if table:
        xml = "<CaretExtension><VolumeInformation><LabelTable>" + "".join(
            f'<Label Key="{k}" Red="0.1" Green="0.2" Blue="0.3" Alpha="1"><![CDATA[{v}]]></Label>\n'
            for k, v in table.items()) + "</LabelTable></VolumeInformation></CaretExtension>"
        body = xml.encode()
        body += b"\0" * (-(len(body) + 8) % 16)
        extension = struct.pack("<ii", len(body) + 8, 0) + body
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *grid.size, 1, 1, 1, 1)
    struct.pack_into("<h", header, 68, intent)
    struct.pack_into("<hh", header, 70, codes[dtype], 8 * int(dtype[1]))
    struct.pack_into("<8f", header, 76, 1, *np.linalg.norm(grid.steps, axis=0), 0, 0, 0, 0)
    struct.pack_into("<f", header, 108, 352 + len(extension))
    struct.pack_into("<ff", header, 112, slope, 0)
    header[123] = 2
    struct.pack_into("<hh", header, 252, 0, 1)
    struct.pack_into("<12f", header, 280, *np.column_stack([grid.steps, grid.origin]).ravel())
    header[344:348] = b"n+1\0"
    if extension:
        header[348] = 1
    data = bytes(header) + extension + voxel_bytes(values, "<" + dtype)
    file.write_bytes(gzip.compress(data, 1) if file.name.lower().endswith(".gz") else data)


def write_mha(file, grid, values, dtype, random):
    types = {"u1": "MET_UCHAR", "i2": "MET_SHORT", "u2": "MET_USHORT", "i4": "MET_INT", "f4": "MET_FLOAT",
             "f8": "MET_DOUBLE"}
    flip = np.array([-1, -1, 1])
    spacing = np.linalg.norm(grid.steps, axis=0)
    directions = [flip * grid.steps[:, a] / spacing[a] for a in range(3)]
    data = voxel_bytes(values, "<" + dtype)
    packed = random.random() < 0.5
    text = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False",
            f"CompressedData = {packed}",
            "TransformMatrix = " + " ".join(repr(float(x)) for d in directions for x in d),
            "Offset = " + " ".join(repr(float(x)) for x in flip * grid.origin), "CenterOfRotation = 0 0 0",
            "ElementSpacing = " + " ".join(repr(float(x)) for x in spacing),
            "DimSize = " + " ".join(str(n) for n in grid.size), f"ElementType = {types[dtype]}",
            "ElementDataFile = LOCAL"]
    file.write_bytes(("\n".join(text) + "\n").encode() + (zlib.compress(data, 1) if packed else data))


def image_values(grid, shapes, random):
    """Speckle, as echoes or a magnetic resonance image are; some with air around."""
    values = random.gamma(4, 20, grid.size)
    for shape in shapes.values():
        values[shape.holds(grid.points)] *= random.uniform(0.5, 2)
    if random.random() < 0.5:
        values[: grid.size[0] // 5] = 0
    return values


def write_image(folder, grid, shapes, random):
    values = image_values(grid, shapes, random)
    kind = random.integers(6)
    if kind == 0:
        write_nrrd(folder / "image.nrrd", grid, values.clip(0, 255), "u1", random)
    elif kind == 1:
        write_nrrd(folder / "t2.NRRD", grid, values * 10 - 300, "i2", random)
    elif kind == 2:
        write_nrrd(folder / "map.nrrd", grid, values / 7, "f4", random)
    elif kind == 3:
        write_nifti(folder / "image.nii.gz", grid, values.clip(0, 255), "u1", random)
    elif kind == 4:
        write_nifti(folder / "CT.NII", grid, values, "i2", random, slope=0.5)
    else:
        write_mha(folder / "us.mha", grid, values.clip(0, 255), "u1", random)


WARNED = ("mirrored", "turned over", "in cm", "sides exchanged")


def make_case(number, folder):
    """What should come of it: "refused", or "structures", {name in the file: (role, centroid, cc)}, and "warned"."""
    random = np.random.default_rng(number)
    shapes = anatomy(random)
    kinds = ["prostate", "urethra", "rectum", "bladder"]
    extra = [k for k in ("penile_bulb",) if random.random() < 0.5]
    extra += (["left", "right"] if random.random() < 0.5 else [])
    form = ["rtstruct", "rtstruct", "segmentation", "table", "folder", "one label"][number % 6]
    fault = None if number % 4 else WARNED[(number // 4) % 4]
    ambiguous = form == "rtstruct" and number % 12 == 1
    if fault == "sides exchanged" and "left" not in extra:
        extra += ["left", "right"]
    shapes = {k: shapes[k] for k in kinds + extra}
    if form == "table" and "left" in shapes and fault != "sides exchanged":
        shapes = {k: v for k, v in shapes.items() if k not in ("left", "right")}
    names = chosen_names(random, shapes)
    if fault == "sides exchanged":
        names["left"], names["right"] = names["right"], names["left"]
    transform = {"mirrored": lambda p: p * (-1, -1, 1), "turned over": lambda p: p * (1, 1, -1),
                 "in cm": lambda p: p * 0.1}.get(fault, lambda p: p)
    expected = {"warned": fault, "structures": {}, "image": False}
    items = list(shapes)
    if form == "rtstruct":
        for target in random.choice(TARGETS, 3, replace=False):
            shapes[target] = Ellipsoid(shapes["prostate"].middle, shapes["prostate"].half + random.uniform(2, 6))
            names[target] = target
        if ambiguous:
            shapes["double"] = Ellipsoid(shapes["prostate"].middle + (0, 0, 2), shapes["prostate"].half * 1.1)
            names["prostate"], names["double"] = "Prostate", "Prostata"
            expected["refused"] = True
        everything = list(shapes)
        random.shuffle(everything)
        slice_mm = random.choice([1.0, 1.25, 2.0, 2.5]) * (0.5 if fault == "in cm" else 1)
        truth = write_rtstruct(folder / "RS.dcm", {k: shapes[k] for k in everything}, names, transform, slice_mm,
                               random)
        for kind in items:
            middle, cc = truth[kind]
            expected["structures"][names[kind]] = (kind, middle, cc * (1e-3 if fault == "in cm" else 1))
        return expected
    spacing = random.uniform(0.8, 1.6, 3)
    if "left" in shapes:
        spacing = spacing + 0.6
    grid = Grid(shapes, spacing, random)
    labels = np.zeros(grid.size, int)
    values = {}
    for kind in sorted(shapes, key=lambda k: k == "urethra"):  # the urethra lies over the gland
        values[kind] = int(random.integers(1, 12)) + 12 * len(values)
        labels[shapes[kind].holds(grid.points)] = values[kind]
    for kind in shapes:
        centroid, cc = grid.truth(labels == values[kind])
        expected["structures"][names[kind]] = (kind, transform(centroid), cc * (1e-3 if fault == "in cm" else 1))
    moved = Grid.__new__(Grid)
    moved.size, moved.points = grid.size, grid.points
    turn = np.diag(transform(np.ones(3)))
    moved.steps, moved.origin = turn @ grid.steps, transform(grid.origin)
    dtype = random.choice(["u1", "i2", "u2", "f4", "i4"])
    if form == "segmentation":
        keys = [(f"Segment{n}_{k}", v) for n, kind in enumerate(shapes)
                for k, v in (("ID", f"s{n}"), ("Name", names[kind]), ("LabelValue", values[kind]), ("Layer", 0))]
        write_nrrd(folder / "Segmentation.seg.nrrd", moved, labels, dtype, random, keys)
    elif form == "table":
        write_nifti(folder / "seg.nii.gz", moved, labels, dtype, random, {values[k]: names[k] for k in shapes})
    elif form == "folder":
        expected["structures"] = {TOTAL_SEGMENTATOR.get(k, k): expected["structures"][names[k]] for k in shapes}
        if fault == "sides exchanged":
            a, b = expected["structures"]["hip_left"], expected["structures"]["hip_right"]
            expected["structures"]["hip_left"], expected["structures"]["hip_right"] = b, a
        for kind in shapes:
            file = kind if fault != "sides exchanged" else {"left": "right", "right": "left"}.get(kind, kind)
            write = [write_nifti, write_nrrd, write_mha][random.integers(3)]
            ending = {write_nifti: ".nii.gz", write_nrrd: ".nrrd", write_mha: ".mha"}[write]
            write(folder / (TOTAL_SEGMENTATOR.get(file, file) + ending), moved, labels == values[kind], dtype, random)
        write_nifti(folder / "spleen.nii.gz", moved, labels * 0, "u1", random)
    else:
        expected["structures"] = {"": ("prostate", *expected["structures"][names["prostate"]][1:])}
        expected["warned"] = "in cm" if fault == "in cm" else None
        write = [write_nrrd, write_mha, write_nifti][random.integers(3)]
        write(folder / ("label" + {write_nrrd: ".nrrd", write_mha: ".mha", write_nifti: ".NII"}[write]), moved,
              labels == values["prostate"], dtype, random)
    if random.random() < 0.6:
        write_image(folder, moved, {}, random)
        expected["image"] = True
    return expected


def read_ply(file):
    """Vertices and triangles of a PLY as the importer writes it, as text."""
    header, rows = file.read_text().split("end_header\n")
    count = int(next(h for h in header.split("\n") if h.startswith("element vertex")).split()[-1])
    rows = rows.split("\n")
    points = np.array([row.split() for row in rows[:count]], float)
    triangles = np.array([row.split() for row in rows[count:] if row], int)
    assert (triangles[:, 0] == 3).all()
    return points, triangles[:, 1:]


def measured(file):
    points, triangles = read_ply(file)
    start = points[0]
    a, b, c = (points[triangles[:, k]] - start for k in range(3))
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    return start + (six[:, None] * (a + b + c)).sum(0) / 4 / six.sum(), six.sum() / 6000


def faults_of(expected, out, ended):
    if expected.get("refused"):
        good = ended.returncode == 2 and all(
            words in ended.stderr
            for words in ("which structure is the prostate?", '"Prostate"', '"Prostata"', "--gland"))
        return [] if good else [f"not refused with its candidates: {ended.returncode} {ended.stderr[-300:]}"]
    if ended.returncode != 0:
        return [f"exit code {ended.returncode}: {ended.stderr[-400:]}"]
    faults = []
    report = json.loads((out / "import.json").read_text())
    by_name = {s["name_in_file"]: s for s in report["structures"]}
    for name, (kind, centroid, cc) in expected["structures"].items():
        if name not in by_name:
            faults.append(f"{name!r} is missing; there are {sorted(by_name)}")
            continue
        s = by_name[name]
        role = {"left": "femoral_head", "right": "femoral_head"}.get(kind, kind)
        if s["role"] != role and not (name.startswith("hip_") and s["role"] == "other"):
            faults.append(f"{name!r} has the role {s['role']}, not {role}")
        at, volume = measured(out / (s["name"] + ".ply"))
        if np.linalg.norm(at - centroid) > 0.1:
            faults.append(f"{name!r} lies at {at.round(2)}, not {np.round(centroid, 2)}")
        if abs(volume - cc) > max(0.01 * cc, 0.02 if expected["warned"] != "in cm" else 2e-4):
            faults.append(f"{name!r} has {volume:.3f} cc, not {cc:.3f}")
    for role in ("urethra", "rectum", "bladder"):
        wanted = sorted(n for n, e in expected["structures"].items() if e[0] == role)
        found = sorted(s["name_in_file"] for s in report["structures"] if s["role"] == role)
        if wanted != found:
            faults.append(f"the {role} is {found}, not {wanted}")
    if report["structures"][0]["role"] != "prostate" or report["structures"][0]["name"] != "prostate":
        faults.append("the gland is not first")
    if bool(expected["warned"]) != bool(report["warnings"]):
        faults.append(f"{expected['warned'] or 'clean'}, with warnings {report['warnings']}")
    if bool(report["volume"]) != expected["image"]:
        faults.append(f"image {expected['image']}, volume {report['volume']}; left {report['left']}")
    if report["warnings"] and not ended.stdout.startswith("import: WARNING: "):
        faults.append("the warning is not at the top")
    return faults


def main():
    program = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 24
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    wrong = 0
    for number in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "in").mkdir()
            expected = make_case(number, folder / "in")
            ended = subprocess.run([program, "import", str(folder / "in"), "--out", str(folder / "out")],
                                   capture_output=True, text=True, check=False)
            faults = faults_of(expected, folder / "out", ended)
        for fault in faults:
            print(f"case {number}: {fault}")
        wrong += bool(faults)
    print(f"{count} cases, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
