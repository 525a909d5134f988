"""Writers of the files that clinics have, in the ways in which their systems write them: for import_cases.py.

Points and grids are in RAS, mm. Voxels are indexed [i, j, k], the first index along the first axis of the file.
"""
import gzip
import pathlib
import struct
import sys
import zlib

import numpy as np
import pydicom
from pydicom.dataelem import DataElement
from pydicom.dataset import Dataset
from pydicom.filebase import DicomBytesIO
from pydicom.filewriter import write_dataset, write_sequence
from pydicom.uid import (DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian, ExplicitVRLittleEndian,
                         ImplicitVRLittleEndian, RLELossless, generate_uid)

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import make_odd_cases as odd  # noqa: E402

# An element that is written as UN stays so.
pydicom.config.replace_un_with_known_vr = False
LPS = np.array([-1, -1, 1])
FRAME, OTHER = odd.FRAME, odd.OTHER
odd.CLASSES |= {"SEG": "1.2.840.10008.5.1.4.1.1.66.4", "OT": "1.2.840.10008.5.1.4.1.1.7",
                "REG": "1.2.840.10008.5.1.4.1.1.66.1", "SR": "1.2.840.10008.5.1.4.1.1.88.11",
                "DOC": "1.2.840.10008.5.1.4.1.1.104.1", "PR": "1.2.840.10008.5.1.4.1.1.11.1"}


def texts(values, digits):
    return [f"{v:.{digits}f}" for v in values]


def decimal_string(tag, values, digits):
    """pydicom would make an object of each of thousands of numbers."""
    return DataElement(tag, "DS", "\\".join(texts(values, digits)), already_converted=True)


# DICOM as data sets of one syntax or another, and as files that are not quite part 10.

ODDITIES = ("plain", "plain", "implicit", "big endian", "deflated", "no preamble", "no meta", "no meta implicit",
            "wrong meta length", "zeros behind", "padding behind", "group lengths", "UN", "UN sequence",
            "undefined lengths", "no syntax")


def as_unknown(data, tag):
    """An element as UN: its bytes in implicit little endian (PS3.5, 6.2.2)."""
    into = DicomBytesIO()
    into.is_little_endian, into.is_implicit_VR = True, True
    element = data[tag]
    if element.VR == "SQ":
        write_sequence(into, element, ["utf-8"])
    else:
        only = Dataset()
        only.add(element)
        write_dataset(into, only)
        into = DicomBytesIO(into.getvalue()[8:])
    data[tag] = DataElement(tag, "UN", into.getvalue(), already_converted=True)


def save(data, path, oddity="plain"):
    path.parent.mkdir(parents=True, exist_ok=True)
    syntax = {"implicit": ImplicitVRLittleEndian, "no meta implicit": ImplicitVRLittleEndian,
              "big endian": ExplicitVRBigEndian, "deflated": DeflatedExplicitVRLittleEndian}.get(oddity)
    if oddity == "big endian" and "PixelData" in data and data.BitsAllocated > 8:
        kind = f"u{data.BitsAllocated // 8}"
        data.PixelData = np.frombuffer(data.PixelData, "<" + kind).astype(">" + kind).tobytes()
    if syntax:
        data.file_meta.TransferSyntaxUID = syntax
        data.is_little_endian = syntax != ExplicitVRBigEndian
        data.is_implicit_VR = syntax == ImplicitVRLittleEndian
    if oddity == "padding behind":
        data.add_new(0xfffcfffc, "OB", bytes(128))
    elif oddity == "group lengths":
        for group in sorted({e.tag.group for e in data if e.tag.group > 2}):
            data.add_new((group, 0), "UL", 7)  # they are retired, and wrong in many files
    elif oddity == "UN":
        for name in ("StructureSetLabel", "Rows", "PixelSpacing", "DoseGridScaling", "RescaleIntercept", "RTPlanLabel"):
            if name in data:
                as_unknown(data, pydicom.datadict.tag_for_keyword(name))
        for roi in data.get("StructureSetROISequence", []):
            as_unknown(roi, pydicom.datadict.tag_for_keyword("ROINumber"))
    elif oddity == "UN sequence":
        for name in ("ROIContourSequence", "ApplicationSetupSequence", "ReferencedRTPlanSequence"):
            if name in data:
                as_unknown(data, pydicom.datadict.tag_for_keyword(name))
    elif oddity == "undefined lengths":
        for element in data:
            if element.VR == "SQ":
                element.is_undefined_length = True
    data.save_as(path, write_like_original=False)
    raw = path.read_bytes()
    meta_end = 132 + 12 + int.from_bytes(raw[140:144], "little")
    if oddity == "no preamble":
        raw = raw[132:]
    elif oddity.startswith("no meta"):
        raw = raw[meta_end:]
    elif oddity == "no syntax":
        raw = raw[:132] + raw[meta_end:]
    elif oddity == "wrong meta length":
        raw = raw[:140] + b"\x04\0\0\0" + raw[144:]
    elif oddity == "zeros behind":
        raw += bytes(1001)
    path.write_bytes(raw)


def contour(points, kind="CLOSED_PLANAR", digits=4):
    """`points` in RAS."""
    item = odd.item(ContourGeometricType=kind, NumberOfContourPoints=len(points))
    item.add(decimal_string(0x30060050, (np.reshape(points, (-1, 3)) * LPS).ravel(), digits))
    return item


def structure_set(structures, charset, colours=None, frame=FRAME):
    """Each: number, name, contours as items."""
    data = odd.rois(*structures, frame=frame)
    if charset:
        data.SpecificCharacterSet = charset
    for item, colour in zip(data.ROIContourSequence, colours or []):
        item.ROIDisplayColor = colour
    return data


def pixels(data, values, bits, stored=None, signed=False):
    """`values` [i, j] or [i, j, k]."""
    data.Rows, data.Columns = values.shape[1], values.shape[0]
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.BitsAllocated, data.BitsStored = bits, stored or bits
    data.HighBit, data.PixelRepresentation = data.BitsStored - 1, int(signed)
    kept = np.round(values).astype(np.int64) & ((1 << data.BitsStored) - 1)
    data.PixelData = kept.astype(f"<u{bits // 8}").tobytes("F") + b"\0" * (kept.size * bits // 8 % 2)


def place(data, R, corner, spacing, digits=5):
    """Of a plane of pixels; `spacing` between columns and rows."""
    data.ImagePositionPatient = texts(corner * LPS, digits)
    data.ImageOrientationPatient = texts((R[:, :2].T * LPS).ravel(), 8)
    data.PixelSpacing = [f"{spacing[1]:.6g}", f"{spacing[0]:.6g}"]


def image_value(i, j, k, most):
    """Tells a voxel's place."""
    return (3 * i + 5 * j + 7 * k) % most


def image_series(folder, rng, R, box, heights, oddity, kind):
    """A series about a box (in the slices' frame) with pixels of 2 mm. Returns what its voxels must be: points and
    values, or None where it cannot be taken; and the words of the line that says what was left. `kind`: plain, missing,
    colour, multi-frame, mixed, 8 bit …"""
    modality = str(rng.choice(["CT", "MR", "US"]))
    step = rng.uniform(1.8, 2.6, 2).round(3)
    size = np.ceil((box[1] - box[0])[:2] / step).astype(int) + 5
    corner = box[0][:2] - 2 * step
    bits, stored, signed, most = {"8 bit": (8, 8, False, 251), "12 bit": (16, 12, False, 4001),
                                  "12 bit signed": (16, 12, True, 2001), "signed": (16, 16, True, 30011)}.get(
        kind, (16, 16, False, 50021))
    if modality == "US" and kind == "plain":
        bits, stored, most = 8, 8, 251
    shift = most // 3 if signed else 0
    slope, intercept = 1.0, 0.0
    if modality == "CT":
        slope, intercept = float(rng.choice([1, 0.5, 0.01])), float(rng.choice([0, -1024]))
    uid = generate_uid(entropy_srcs=["series", str(folder)])
    i, j = np.meshgrid(np.arange(size[0]), np.arange(size[1]), indexing="ij")
    missing = set(rng.choice(np.arange(2, len(heights) - 2), 2, replace=False)) if kind == "missing" else set()
    order, names = rng.permutation(len(heights)), rng.permutation(len(heights))
    points, values = [], []
    for n in order:
        k = int(n)
        at = R @ np.append(corner, heights[k])
        data = odd.new_set(modality, uid, k)
        data.SeriesInstanceUID, data.FrameOfReferenceUID = uid, FRAME
        place(data, R, at, step)
        data.SliceThickness = f"{abs(heights[1] - heights[0]):.4g}"
        data.InstanceNumber = k + 1 if rng.random() < 0.8 else len(heights) - k
        kept = image_value(i, j, k, most) - shift
        pixels(data, kept, bits, stored, signed)
        if modality == "CT":
            data.RescaleSlope, data.RescaleIntercept = str(slope), str(intercept)
        if kind == "colour":
            data.SamplesPerPixel, data.PhotometricInterpretation, data.PlanarConfiguration = 3, "RGB", 0
            data.BitsAllocated = data.BitsStored = 8
            data.HighBit = 7
            data.PixelData = bytes(3 * kept.size + 3 * kept.size % 2)
        if k in missing:
            continue
        if kind == "multi-frame":
            data.NumberOfFrames = len(heights)
            data.PixelData = data.PixelData * len(heights)
        name = f"{'IMG' if rng.random() < 0.5 else modality}{names[n]:04}.dcm"
        if kind == "RLE" and bits == 16:
            data.compress(RLELossless)
            save(data, folder / name)
        else:
            save(data, folder / name, oddity)
        if kind == "multi-frame":
            return None, [name, "(0028,0008)"]
        pick = rng.integers(0, size, (3, 2))
        points += [at + R[:, :2] @ (p * step) for p in pick]
        values += [slope * kept[tuple(p)] + intercept for p in pick]
    if kind == "colour":
        return None, ["RGB"]
    return (np.array(points), np.array(values)), ["2 slices are missing"] if missing else None


def dose_file(path, rng, middle, plan=None, oddity="plain"):
    """An RTDOSE about a point. Returns points and values of its voxels."""
    axes = np.array([[[1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, -1, 0]], [[-1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 0, -1]],
                     [[1, 0, 0], [0, 0, 1]], [[0, 1, 0], [0, 0, -1]], [[0, 1, 0], [0, 0, 1]], [[0, -1, 0], [1, 0, 0]]])
    u, v = axes[rng.integers(len(axes))].astype(float)
    absolute = bool(rng.random() < 0.4)
    if not absolute and rng.random() < 0.3:
        turn = odd_turn(rng)
        u, v = turn @ u, turn @ v
    n = np.cross(u, v)
    step = rng.uniform(1.5, 3, 3).round(2)
    size = rng.integers(14, 26, 3)
    up = float(rng.choice([1, -1]))
    axis = int(np.argmax(np.abs(n)))
    # Absolute offsets are coordinates along the patient's axis, whatever the sign of the normal.
    way = up * (np.eye(3)[axis] if absolute else n)
    corner = (middle * LPS - 0.5 * ((size[0] - 1) * step[0] * u + (size[1] - 1) * step[1] * v
                                    + (size[2] - 1) * step[2] * way)).round(3)
    offsets = up * step[2] * np.arange(size[2]) + (corner[axis] if absolute else 0)
    i, j, k = np.meshgrid(*(np.arange(m) for m in size), indexing="ij")
    points = (corner + i[..., None] * step[0] * u + j[..., None] * step[1] * v + k[..., None] * step[2] * way) * LPS
    far = np.linalg.norm(points - middle - (4, 2, 7), axis=-1)
    gray = 160 * np.exp(-(far / 18) ** 2) + 0.5 * (points - middle) @ (0.11, 0.23, 0.37) + 20
    bits = int(rng.choice([16, 32]))
    scaling = gray.max() / (60000 if bits == 16 else 4e9)
    data = odd.new_set("RTDOSE", path)
    data.FrameOfReferenceUID = FRAME
    data.DoseUnits, data.DoseType, data.DoseSummationType = "GY", "PHYSICAL", "PLAN"
    data.DoseGridScaling = f"{scaling:.9g}"
    pixels(data, gray / float(data.DoseGridScaling), bits)
    data.NumberOfFrames = int(size[2])
    data.GridFrameOffsetVector = texts(offsets, 4)
    place(data, np.stack([u * LPS, v * LPS, n * LPS], 1), corner * LPS, step)
    if plan is not None:
        data.ReferencedRTPlanSequence = pydicom.Sequence(
            [odd.item(ReferencedSOPClassUID=plan.SOPClassUID, ReferencedSOPInstanceUID=plan.SOPInstanceUID)])
    save(data, path, oddity)
    pick = rng.integers(0, size, (40, 3))
    return points[tuple(pick.T)], gray[tuple(pick.T)]


def odd_turn(rng):
    from case_shapes import turned
    return turned(rng.normal(size=3), rng.uniform(0.05, 0.4))


def segmentation(path, grid, masks, names, kind="BINARY", oddity="plain"):
    """DICOM SEG: a frame for each slice of a segment that has voxels, or of LABELMAP for each slice; in any order of
    slices. A LABELMAP lists its background too where there is an odd number of segments. The grid must be at right
    angles."""
    spacing = np.linalg.norm(grid.steps, axis=0)
    data = odd.new_set("SEG", path)
    data.SegmentationType, data.FrameOfReferenceUID, data.SpecificCharacterSet = kind, FRAME, "ISO_IR 192"
    listed = list(enumerate(names, 1))
    if kind == "LABELMAP" and len(names) % 2:
        listed.insert(0, (0, "Background"))
    data.SegmentSequence = pydicom.Sequence(
        [odd.item(SegmentNumber=n, SegmentLabel=name, SegmentAlgorithmType="AUTOMATIC") for n, name in listed])
    frames, packed = [], []
    if kind == "LABELMAP":
        masks = [np.max([n * mask for n, mask in enumerate(masks, 1)], axis=0)]
    for n, mask in enumerate(masks, 1):
        for k in range(grid.size[2])[::-1 if n % 2 else 1]:
            if not mask[:, :, k].any():
                continue
            packed.append(mask[:, :, k].ravel("F"))
            frame = odd.item(PlanePositionSequence=pydicom.Sequence([odd.item(ImagePositionPatient=texts(
                (grid.origin + k * grid.steps[:, 2]) * LPS, 5))]))
            if kind != "LABELMAP":
                frame.SegmentIdentificationSequence = pydicom.Sequence([odd.item(ReferencedSegmentNumber=n)])
            frames.append(frame)
    data.PerFrameFunctionalGroupsSequence = pydicom.Sequence(frames)
    data.SharedFunctionalGroupsSequence = pydicom.Sequence([odd.item(
        PlaneOrientationSequence=pydicom.Sequence([odd.item(
            ImageOrientationPatient=texts((grid.steps[:, :2] / spacing[:2]).T.ravel() * np.tile(LPS, 2), 8))]),
        PixelMeasuresSequence=pydicom.Sequence([odd.item(PixelSpacing=texts(spacing[1::-1], 6),
                                                         SliceThickness=f"{spacing[2]:.6g}",
                                                         SpacingBetweenSlices=f"{spacing[2]:.6g}")]))])
    data.Rows, data.Columns, data.NumberOfFrames = int(grid.size[1]), int(grid.size[0]), len(frames)
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.BitsAllocated = data.BitsStored = 1 if kind == "BINARY" else 8
    data.HighBit, data.PixelRepresentation = data.BitsStored - 1, 0
    values = np.concatenate(packed)
    if kind == "FRACTIONAL":  # what is less than half is outside
        data.SegmentationFractionalType, data.MaximumFractionalValue = "PROBABILITY", 200
        values = np.where(values, 100 + np.arange(len(values)) % 101, np.arange(len(values)) % 100)
    raw = (np.packbits(values, bitorder="little") if kind == "BINARY" else values.astype("u1")).tobytes()
    data.PixelData = raw + b"\0" * (len(raw) % 2)
    save(data, path, oddity)


# Voxels in files of research.

TYPES = {"u1": "uint8", "i1": "signed char", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "i8": "longlong",
         "f4": "float", "f8": "double"}


def write_nrrd(file, grid, values, dtype, rng, keys=()):
    """`values` [i, j, k], or [layer, i, j, k]."""
    space, flip = [("left-posterior-superior", LPS), ("LPS", LPS), ("right-anterior-superior", np.ones(3)),
                   ("RAS", np.ones(3)), ("left-anterior-superior", np.array([-1, 1, 1]))][rng.integers(5)]
    order = ">" if rng.random() < 0.2 and dtype[1] != "1" else "<"
    encoding = str(rng.choice(["raw", "gzip", "gz"])) if values.size > 2000 or rng.random() < 0.9 else "ascii"

    def vector(v):
        return "(" + ",".join(repr(float(x)) for x in v * flip) + ")"
    data = values.astype(order + dtype).tobytes("F")
    many = values.ndim == 4
    header = [f"type: {TYPES[dtype]}", f"dimension: {values.ndim}",
              "sizes: " + " ".join(str(n) for n in values.shape), "space: " + space,
              "space directions: " + ("none " if many else "")
              + " ".join(vector(grid.steps[:, a]) for a in range(3)),
              "space origin: " + vector(grid.origin), "kinds: " + ("list " if many else "") + "domain domain domain",
              "endian: " + ("big" if order == ">" else "little"), "encoding: " + encoding]
    if rng.random() < 0.3:
        header = [header[k] for k in [*rng.permutation(2), 2, 3, 6, 5, 4, 8, 7]]
    end = "\r\n" if rng.random() < 0.15 else "\n"
    text = end.join(["NRRD0004", "# written for a test", *header, *(f"{k}:={v}" for k, v in keys), "", ""])
    if encoding == "ascii":
        data = " ".join(str(v) for v in values.ravel("F")).encode()
    file.write_bytes(text.encode() + (gzip.compress(data, 1) if encoding.startswith("gz") else data))


def quaternion_of(R):
    w, v = np.linalg.eigh(np.array([
        [R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[2, 1] - R[1, 2]],
        [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1], R[0, 2] - R[2, 0]],
        [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)]]) / 3)
    q = v[:, np.argmax(w)]
    return q * np.sign(q[3] or 1)  # x, y, z, w


def write_nifti(file, grid, values, dtype, rng, table=None, slope=0.0, intent=0):
    codes = {"u1": 2, "i2": 4, "i4": 8, "f4": 16, "f8": 64, "i1": 256, "u2": 512, "u4": 768, "i8": 1024}
    e = ">" if rng.random() < 0.2 else "<"
    extension = b""
    if table:
        xml = "<CaretExtension><VolumeInformation><LabelTable>" + "".join(
            f'<Label Key="{k}" Red="0.1" Green="0.2" Blue="0.3" Alpha="1"><![CDATA[{v}]]></Label>\n'
            for k, v in table.items()) + "</LabelTable></VolumeInformation></CaretExtension>"
        body = xml.encode()
        body += b"\0" * (-(len(body) + 8) % 16)
        extension = struct.pack(e + "ii", len(body) + 8, 0) + body
    spacing = np.linalg.norm(grid.steps, axis=0)
    units, scale = [(2, 1), (2, 1), (0, 1), (1, 1e-3), (3, 1e3)][rng.integers(5)]
    header = bytearray(352)
    struct.pack_into(e + "i", header, 0, 348)
    struct.pack_into(e + "8h", header, 40, 3, *grid.size, 1, 1, 1, 1)
    struct.pack_into(e + "h", header, 68, intent)
    struct.pack_into(e + "hh", header, 70, codes[dtype], 8 * int(dtype[1]))
    directions = grid.steps / spacing
    side = np.sign(np.linalg.det(directions))
    is_straight = np.allclose(directions.T @ directions, np.eye(3), atol=1e-9)
    # qform, sform.
    codes_of = (0, 2)
    if is_straight and rng.random() < 0.7:
        codes_of = (1, int(rng.integers(2)))
    struct.pack_into(e + "8f", header, 76, side if codes_of[0] else 1, *spacing * scale, 0, 0, 0, 0)
    struct.pack_into(e + "f", header, 108, 352 + len(extension))
    struct.pack_into(e + "ff", header, 112, slope, 0)
    header[123] = units
    struct.pack_into(e + "hh", header, 252, *codes_of)
    if codes_of[0]:
        q = quaternion_of(directions * (1, 1, side))
        struct.pack_into(e + "6f", header, 256, *q[:3], *grid.origin * scale)
    if codes_of[1]:
        struct.pack_into(e + "12f", header, 280, *scale * np.column_stack([grid.steps, grid.origin]).ravel())
    header[344:348] = b"n+1\0"
    if extension:
        header[348] = 1
    data = bytes(header) + extension + values.astype(e + dtype).tobytes("F")
    file.write_bytes(gzip.compress(data, 1) if file.name.lower().endswith(".gz") else data)


def write_mha(file, grid, values, dtype, rng):
    types = {"u1": "MET_UCHAR", "i1": "MET_CHAR", "i2": "MET_SHORT", "u2": "MET_USHORT", "i4": "MET_INT",
             "u4": "MET_UINT", "f4": "MET_FLOAT", "f8": "MET_DOUBLE"}
    spacing = np.linalg.norm(grid.steps, axis=0)
    directions = [LPS * grid.steps[:, a] / spacing[a] for a in range(3)]
    order = ">" if rng.random() < 0.2 else "<"
    data = values.astype(order + dtype).tobytes("F")
    packed = rng.random() < 0.5
    text = ["ObjectType = Image", "NDims = 3", "BinaryData = True",
            f"{'BinaryDataByteOrderMSB' if rng.random() < 0.7 else 'ElementByteOrderMSB'} = {order == '>'}",
            f"CompressedData = {packed}",
            f"{rng.choice(['TransformMatrix', 'Rotation', 'Orientation'])} = "
            + " ".join(repr(float(x)) for d in directions for x in d),
            f"{rng.choice(['Offset', 'Position', 'Origin'])} = " + " ".join(repr(float(x)) for x in LPS * grid.origin),
            "CenterOfRotation = 0 0 0", "AnatomicalOrientation = RAI",
            "ElementSpacing = " + " ".join(repr(float(x)) for x in spacing),
            "DimSize = " + " ".join(str(n) for n in grid.size), f"ElementType = {types[dtype]}",
            "ElementDataFile = LOCAL"]
    file.write_bytes(("\n".join(text) + "\n").encode() + (zlib.compress(data, 1) if packed else data))


# Surfaces.

def sphere_mesh(shape, rings=24, around=36):
    """A closed surface about an ellipsoid, outward."""
    t, p = np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(around) / around
    unit = [(0, 0, 1), *((np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)) for a in t for b in p), (0, 0, -1)]
    v = shape.middle + (np.array(unit) * shape.half) @ shape.turn.T
    f = []
    for b in range(around):
        c = (b + 1) % around
        f.append((0, 1 + b, 1 + c))
        for a in range(rings - 2):
            q = 1 + a * around
            f += [(q + b, q + around + b, q + around + c), (q + b, q + around + c, q + c)]
        q = 1 + (rings - 2) * around
        f.append((q + b, len(v) - 1, q + c))
    return v, np.array(f)


def write_mesh(path, v, f, kind, rng, comment=""):
    """`kind`: stl, STL text, ply, ply text, ply big, obj; `comment`: SPACE=LPS or nothing."""
    bom = b"\xef\xbb\xbf" if rng.random() < 0.3 else b""
    behind = bytes(int(rng.integers(1, 200))) if rng.random() < 0.3 else b""
    end = "\r\n" if rng.random() < 0.3 else "\n"
    digits = ".6f" if rng.random() < 0.5 else ".8e"

    def words(p):
        return " ".join(format(x, digits) for x in p)
    if kind == "stl":
        rows = np.zeros(len(f), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
        rows["v"] = v[f]
        head = (b"solid " if rng.random() < 0.3 else b"") + comment.encode()
        path.write_bytes(head.ljust(80)[:80] + struct.pack("<I", len(f)) + rows.tobytes() + behind)
    elif kind == "STL text":
        lines = [f"solid shape {comment}"]
        for t in f:
            lines += ["facet normal 0 0 0", " outer loop", *(f"  vertex {words(v[k])}" for k in t), " endloop",
                      "endfacet"]
        text = end.join([*lines, "endsolid shape", ""])
        path.write_bytes(bom + (text.upper() if rng.random() < 0.3 else text).encode())
    elif kind == "obj":
        named = rng.random() < 0.5
        lines = ([f"# {comment}"] if comment else []) + ["mtllib nothing.mtl", "o shape", *(f"v {words(p)}" for p in v)]
        lines += ["vn 0 0 1", "usemtl red"]
        lines += ["f " + " ".join(f"{k + 1}//1" if named else str(k + 1) for k in t) for t in f]
        path.write_bytes(bom + end.join([*lines, ""]).encode())
    else:
        text, order = kind == "ply text", ">" if kind == "ply big" else "<"
        form = "ascii" if text else "binary_big_endian" if order == ">" else "binary_little_endian"
        wide = rng.random() < 0.5
        real = "double" if wide else "float"
        has_normals = rng.random() < 0.4
        head = ["ply", f"format {form} 1.0", f"comment {comment or 'shape'}", f"element vertex {len(v)}",
                *(f"property {real} {a}" for a in "xyz"),
                *([f"property float n{a}" for a in "xyz"] if has_normals else []),
                f"element face {len(f)}", f"property list uchar int {rng.choice(['vertex_indices', 'vertex_index'])}",
                "end_header"]
        if text:
            rows = [words(p) + (" 0 0 1" if has_normals else "") for p in v] + ["3 " + " ".join(map(str, t)) for t in f]
            path.write_bytes(bom + end.join([*head, *rows, ""]).encode())
            return
        of_vertex = [("p", order + ("f8" if wide else "f4"), 3)] + ([("n", order + "f4", 3)] if has_normals else [])
        points, faces = np.zeros(len(v), of_vertex), np.zeros(len(f), [("n", "u1"), ("t", order + "i4", 3)])
        points["p"], faces["n"], faces["t"] = v, 3, f
        path.write_bytes("\n".join([*head, ""]).encode() + points.tobytes() + faces.tobytes() + behind)
