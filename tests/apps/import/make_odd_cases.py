#!/usr/bin/python3
"""Patients' files as planning systems and scanners write them, but rarely: for the tests of `brachy import`. Made from
nothing by pydicom and numpy; never committed.

usage: make_odd_cases.py OUT     writes OUT/NAME/… and OUT/cases.json: {"NAME": {…}} with
  "cc": {structure: volume}      what must be read
  "says", "out": [words]         of stderr, of stdout
  "volume": [x, y, z, value]     the image's value at a point in RAS, mm
  "seeds": [[x, y, z, ax, ay, az, number, strength]]    RAS, in the order of seeds.csv
  "refused": [words]             of the one line that refuses it
"""
import gzip
import json
import pathlib
import struct
import sys

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian, generate_uid

CLASSES = {"US": "1.2.840.10008.5.1.4.1.1.6.1", "CT": "1.2.840.10008.5.1.4.1.1.2", "MR": "1.2.840.10008.5.1.4.1.1.4",
           "RTSTRUCT": "1.2.840.10008.5.1.4.1.1.481.3", "RTDOSE": "1.2.840.10008.5.1.4.1.1.481.2",
           "RTPLAN": "1.2.840.10008.5.1.4.1.1.481.5"}
FRAME, OTHER = generate_uid(entropy_srcs=["frame"]), generate_uid(entropy_srcs=["other frame"])
HEIGHTS = np.arange(12) * 3.0


def new_set(modality, *name):
    data = Dataset()
    data.file_meta = FileMetaDataset()
    data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data.SOPClassUID = data.file_meta.MediaStorageSOPClassUID = CLASSES[modality]
    uid = generate_uid(entropy_srcs=[modality, *map(str, name)])
    data.SOPInstanceUID = data.file_meta.MediaStorageSOPInstanceUID = uid
    data.Modality = modality
    data.is_little_endian, data.is_implicit_VR = True, False
    return data


def save(data, path):
    path.parent.mkdir(parents=True, exist_ok=True)
    data.save_as(path, write_like_original=False)


def ring(a, b, z, middle=(0, 0), n=72):
    """An ellipse of half axes a and b."""
    t = 2 * np.pi * np.arange(n) / n
    return np.stack([middle[0] + a * np.cos(t), middle[1] + b * np.sin(t), np.full(n, z)], axis=1)


def area(a, b, n=72):
    return 0.5 * n * np.sin(2 * np.pi / n) * a * b


def contour(points, kind="CLOSED_PLANAR"):
    item = Dataset()
    item.ContourGeometricType = kind
    item.NumberOfContourPoints = len(points)
    item.ContourData = [f"{v:.4f}" for v in np.asarray(points, float).ravel()]
    return item


def rois(*structures, frame=FRAME, charset=None):
    """Each: number, name, contours."""
    data = new_set("RTSTRUCT", *[name for _, name, _ in structures])
    if charset:
        data.SpecificCharacterSet = charset
    data.StructureSetLabel = "S"
    data.StructureSetROISequence, data.ROIContourSequence = pydicom.Sequence(), pydicom.Sequence()
    for number, name, contours in structures:
        roi = Dataset()
        roi.ROINumber, roi.ROIName, roi.ReferencedFrameOfReferenceUID = number, name, frame
        data.StructureSetROISequence.append(roi)
        drawn = Dataset()
        drawn.ReferencedROINumber, drawn.ContourSequence = number, pydicom.Sequence(contours)
        data.ROIContourSequence.append(drawn)
    return data


def gland(heights=HEIGHTS, number=1, name="Prostate"):
    return number, name, [contour(ring(20, 15, z)) for z in heights]


def slab_cc(heights, mm2):
    """What contours stand for: each half the way to its neighbours, at the ends half the median distance at most."""
    gaps = np.diff(heights)
    middle = np.sort(gaps)[len(gaps) // 2]
    ends = min(middle, gaps[0]) / 2 + min(middle, gaps[-1]) / 2
    return (heights[-1] - heights[0] + ends) * mm2 / 1000


GLAND_CC = slab_cc(HEIGHTS, area(20, 15))


def image(n, values, position, modality="CT", orientation=(1, 0, 0, 0, 1, 0), bits=16, stored=None, signed=False,
          series="series", frame=FRAME):
    data = new_set(modality, series, n)
    data.SeriesInstanceUID = generate_uid(entropy_srcs=[series])
    data.FrameOfReferenceUID = frame
    data.ImagePositionPatient = [f"{v:.5f}" for v in position]
    data.ImageOrientationPatient = [f"{v:.8f}" for v in orientation]
    data.PixelSpacing = [2, 1]
    data.SliceThickness = 3
    data.Rows, data.Columns = values.shape
    data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
    data.BitsAllocated, data.BitsStored = bits, stored or bits
    data.HighBit, data.PixelRepresentation = data.BitsStored - 1, int(signed)
    kept = np.round(values).astype(np.int64) & ((1 << data.BitsStored) - 1)
    data.PixelData = kept.astype("<u1" if bits == 8 else "<u2").tobytes()
    return data


COLUMNS, ROWS = np.meshgrid(np.arange(60), np.arange(24))
RAMP = 10 * COLUMNS + 3 * ROWS  # a column is 1 mm, a row 2 mm


def series(into, change=lambda n, data: data, heights=HEIGHTS, place=lambda z: (-30, -24, z), structures=None, **more):
    save(structures or rois(gland()), into / "rtstruct.dcm")
    for n, z in enumerate(heights):
        data = change(n, image(n, RAMP + 7 * n, place(z), **more))
        if data is not None:
            save(data, into / f"image_{n:02}.dcm")


def nifti(path, labels, sform=None, qform=None, units=2, dim=None, pack=True, cut=0):
    """sform, qform: origin and spacing of maps along the axes."""
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, *(dim or (3, *labels.shape[::-1], 1, 1, 1, 1)))
    struct.pack_into("<hh", header, 70, 2, 8)
    struct.pack_into("<8f", header, 76, 1, *(qform or sform)[1], 1, 1, 1, 1)
    struct.pack_into("<f", header, 108, 352)
    header[123] = units
    struct.pack_into("<hh", header, 252, int(qform is not None), int(sform is not None))
    if qform:
        struct.pack_into("<6f", header, 256, 0, 0, 0, *qform[0])
    if sform:
        for row in range(3):
            values = [0.0] * 4
            values[row], values[3] = sform[1][row], sform[0][row]
            struct.pack_into("<4f", header, 280 + 16 * row, *values)
    header[344:348] = b"n+1\0"
    content = bytes(header) + labels.astype(np.uint8).tobytes()
    content = gzip.compress(content) if pack else content
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content[:len(content) - cut])


def nrrd(path, labels, fields="", encoding="raw", data=None, kind="uint8"):
    head = (f"NRRD0004\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\nsizes: "
            f"{' '.join(map(str, labels.shape[::-1]))}\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
            f"endian: little\nencoding: {encoding}\nspace origin: (0,0,0)\n{fields}\n")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(head.encode() + (labels.tobytes() if data is None else data))


def item(**elements):
    data = Dataset()
    for keyword, value in elements.items():
        setattr(data, keyword, value)
    return data


def implant(seeds, sources):
    """An RTPLAN of seeds as they lie after an implant: a channel each, of any direction. Each: number of its source,
    position and, where it is known, direction; LPS."""
    data = new_set("RTPLAN", "implant", len(seeds), *sources)
    data.RTPlanLabel, data.FrameOfReferenceUID = "POST", FRAME
    data.BrachyTreatmentTechnique, data.BrachyTreatmentType = "PERMANENT", "MANUAL"
    data.SourceSequence = pydicom.Sequence(
        [item(SourceNumber=n, SourceIsotopeName=name, ReferenceAirKermaRate=str(strength), SourceIsotopeHalfLife="1")
         for n, (name, strength) in enumerate(sources, 1)])
    setups = []
    for n, (source, at, axis) in enumerate(seeds, 1):
        points = [item(ControlPointIndex=k, ControlPoint3DPosition=[f"{v:.4f}" for v in at]) for k in range(2)]
        if axis is not None:
            for point in points:
                point.ControlPointOrientation = [float(v) for v in axis]
        channel = item(ChannelNumber=1, ReferencedSourceNumber=source, NumberOfControlPoints=2,
                       BrachyControlPointSequence=pydicom.Sequence(points))
        setups.append(item(ApplicationSetupNumber=n, ChannelSequence=pydicom.Sequence([channel])))
    data.ApplicationSetupSequence = pydicom.Sequence(setups)
    return data


def main():
    out, cases = pathlib.Path(sys.argv[1]), {}

    def case(name, **expected):
        cases[name] = expected
        return out / name

    def structures(name, *rois_of, charset=None, change=None, **expected):
        data = rois(*rois_of, charset=charset)
        if change:
            change(data)
        save(data, case(name, **expected) / "rtstruct.dcm")

    whole = {"prostate": GLAND_CC}

    # Structures.
    outer, inner = ring(20, 15, 0), ring(8, 6, 0)
    keyhole = np.concatenate([outer, outer[:1], inner[::-1], inner[-1:]])  # along one line to the hole and back
    hollow_cc = slab_cc(HEIGHTS, area(20, 15) - area(8, 6))
    structures("keyhole", (1, "Prostate", [contour(keyhole + [0, 0, z]) for z in HEIGHTS]),
               cc={"prostate": hollow_cc})
    for kind in ("CLOSED_PLANAR", "CLOSEDPLANAR_XOR"):
        structures("hole_" + kind.lower(), (1, "Prostate", [contour(ring(*half, z), kind) for z in HEIGHTS
                                                          for half in ((20, 15), (8, 6))]),
                   cc={"prostate": hollow_cc})
    half = 10 ** 2 * np.arccos(0.4) - 4 * np.sqrt(10 ** 2 - 4 ** 2)  # half of what two discs 8 mm apart share
    structures("crossing", (1, "Prostate", [contour(ring(10, 10, z, (x, 0))) for z in HEIGHTS for x in (0, 8)]),
               cc={"prostate": slab_cc(HEIGHTS, 2 * (np.pi * 100 - 2 * half))}, out=["contours cross in 12 planes"])
    structures("two_of_one_name", gland(), (2, "Urethra", [contour(ring(3, 3, z)) for z in HEIGHTS]),
               (3, "Urethra", [contour(ring(5, 5, z, (40, 0))) for z in HEIGHTS]),
               refused=["which structure is the urethra?", "--role urethra="])
    structures("number_gaps", gland(number=907), (12, "Bladder", [contour(ring(9, 9, z, (0, 40))) for z in HEIGHTS]),
               cc=whole | {"bladder": slab_cc(HEIGHTS, area(9, 9))})
    structures("point_and_empty", gland(), (2, "Marker", [contour([[1, 2, 3]], "POINT")]), (3, "Empty", []),
               (4, "Line", [contour(ring(9, 9, 3)[:20], "OPEN_PLANAR")]), cc=whole,
               says=["ROI 2: ", "ROI 3: ", "ROI 4: "])
    structures("closed_without_area", gland(), (2, "Iso", [contour([[1, 2, 3]])]),
               (3, "Flat", [contour([[0, 0, z], [4, 0, z], [8, 0, z]]) for z in HEIGHTS]), cc=whole,
               says=["ROI 2: ", "ROI 3: "])
    structures("latin_1", gland(name="Pr\u00f3stata"), (2, "V\u00e9sicule", [contour(ring(5, 5, z, (40, 0)))
                                                                          for z in HEIGHTS]),
               charset="ISO_IR 100", cc={"prostate": GLAND_CC, "Vesicule": slab_cc(HEIGHTS, area(5, 5))})
    structures("utf_8", gland(name="\u524d\u7acb\u817a prostate"),
               (2, "\u8180\u80f1", [contour(ring(5, 5, z, (40, 0))) for z in HEIGHTS]),
               charset="ISO_IR 192", cc={"prostate": GLAND_CC, "bladder": slab_cc(HEIGHTS, area(5, 5))})
    uneven = np.array([0, 1, 2, 3, 4, 5, 6, 7, 12, 17, 22, 27, 32.0])
    structures("uneven_planes", gland(uneven), cc={"prostate": slab_cc(uneven, area(20, 15))})
    # Over 64 kB of numbers: written as UN.
    long = np.arange(3) * 3.0
    structures("long_contours", (1, "Prostate", [contour(ring(20, 15, z, n=6000)) for z in long]),
               cc={"prostate": slab_cc(long, area(20, 15, 6000))})
    structures("one_plane", gland([3.0]), cc={"prostate": area(20, 15) / 1000})
    one_type = contour(ring(9, 9, 0), "CLOSED_SPHERE")
    structures("unknown_type", (1, "Prostate", [one_type]), refused=["rtstruct.dcm", "(3006,0042)", "CLOSED_SPHERE"])
    structures("only_points", (1, "Prostate", [contour([[1, 2, 3]], "POINT")]), refused=["no structure", "ROI 1"])
    structures("roi_without_number", gland(), refused=["no structure", "(3006,0084)"],
               change=lambda d: delattr(d.ROIContourSequence[0], "ReferencedROINumber"))
    structures("not_finite", (1, "Prostate", [contour(ring(9, 9, z)) for z in HEIGHTS]),
               refused=["rtstruct.dcm", "(3006,0050)"],
               change=lambda d: setattr(d.ROIContourSequence[0].ContourSequence[2], "ContourData",
                                        ["1e300"] * 216))

    # Contours of a slice at slightly different heights, drawn again from another start, and structures that are wrong.
    jittered = (1, "Prostate", [contour(ring(20, 15, z)) for z in HEIGHTS] +
                [contour(ring(8, 6, z + 0.011)) for z in HEIGHTS])
    structures("hole_a_little_higher", jittered, cc={"prostate": hollow_cc})

    def again(points):
        return np.roll(points, 17, axis=0)[::-1]
    structures("drawn_twice", (1, "Prostate", [contour(c) for z in HEIGHTS
                                               for c in (ring(20, 15, z), again(ring(20, 15, z)))]),
               cc=whole, out=["12 contours occurred twice"])
    bent = ring(5, 5, 6, (40, 0))
    bent[3, 2] += 9
    structures("one_is_not_planar", gland(), (2, "Marker", [contour(bent)]), cc=whole, says=["ROI 2: Marker", "plane"])
    structures("no_points_in_one", gland(), (2, "Line", [contour(ring(9, 9, z, (0, 40))) for z in HEIGHTS]),
               cc=whole | {"Line": slab_cc(HEIGHTS[1:], area(9, 9))},
               change=lambda d: setattr(d.ROIContourSequence[1].ContourSequence[0], "ContourData", None))
    structures("count_off_by_one", gland(), cc=whole, out=["Number"],
               change=lambda d: setattr(d.ROIContourSequence[0].ContourSequence[2], "NumberOfContourPoints", 71))
    structures("unknown_number", gland(), (2, "X", [contour(ring(9, 9, 3))]), cc=whole, says=["is 77"],
               change=lambda d: setattr(d.ROIContourSequence[1], "ReferencedROINumber", 77))
    structures("roi_of_another_frame", gland(), (2, "MR", [contour(ring(9, 9, 3))]), cc=whole, says=["ROI 2: MR"],
               change=lambda d: setattr(d.StructureSetROISequence[1], "ReferencedFrameOfReferenceUID", OTHER))
    structures("gland_is_wrong", (1, "Prostate", [contour(bent)]), (2, "Bladder", gland()[2]),
               refused=["rtstruct.dcm", "(3006,0050)", "plane"])

    # The same data set as files that are no part 10.
    def bytes_of(name, change, syntax=ExplicitVRLittleEndian, **expected):
        data = rois(gland())
        data.file_meta.TransferSyntaxUID = syntax
        data.is_implicit_VR = syntax == ImplicitVRLittleEndian
        into = case(name, **(expected or {"cc": whole})) / "RS"
        save(data, into)
        into.write_bytes(change(into.read_bytes()))

    def without_meta(raw):
        return raw[132 + 12 + int.from_bytes(raw[140:144], "little"):]
    for syntax, kind in ((ExplicitVRLittleEndian, "explicit"), (ImplicitVRLittleEndian, "implicit")):
        bytes_of("no_preamble_" + kind, lambda raw: raw[132:], syntax)
        bytes_of("no_meta_" + kind, without_meta, syntax)
        bytes_of("no_syntax_" + kind, lambda raw: raw[:132] + without_meta(raw), syntax)
        bytes_of("wrong_meta_length_" + kind, lambda raw: raw[:140] + b"\x04\0\0\0" + raw[144:], syntax)
        bytes_of("zeros_behind_" + kind, lambda raw: raw + bytes(1001), syntax)
    bytes_of("another_syntax_than_said", lambda raw: raw.replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2\0\0\0"))
    bytes_of("kind_is_unknown", lambda raw: raw.replace(b"\x06\x30\x26\0LO", b"\x06\x30\x26\0??"))

    # Image series.
    def ct(name, **more):
        expected = {k: more.pop(k) for k in ("cc", "says", "volume", "refused") if k in more}
        if "refused" not in expected:
            expected.setdefault("cc", whole)
        series(case(name, **expected), **more)

    def rescaled(n, data):
        data.RescaleSlope, data.RescaleIntercept = "0.5", "-1024"
        return data

    # At column 30, row 10, slice 4: LPS (0, −4, 12).
    at, value = [0, 4, 12], 10 * 30 + 3 * 10 + 7 * 4
    ct("ct_plain", volume=[*at, value])
    ct("ct_rescaled", change=rescaled, volume=[*at, 0.5 * value - 1024])
    ct("ct_signed", change=lambda n, d: image(n, RAMP + 7 * n - 500, (-30, -24, HEIGHTS[n]), signed=True),
       volume=[*at, value - 500])
    ct("ct_twelve_bits_signed",
       change=lambda n, d: image(n, RAMP + 7 * n - 500, (-30, -24, HEIGHTS[n]), signed=True, stored=12),
       volume=[*at, value - 500])

    def overlaid(n, data):  # an overlay above the stored bits, as in DICOM before 2004
        words = np.frombuffer(data.PixelData, "<u2") | 0x8000
        data.PixelData = words.astype("<u2").tobytes()
        return data
    ct("ct_overlay_in_high_bits", stored=12, change=overlaid, volume=[*at, value])
    ct("us_backwards", modality="US", bits=8, heights=HEIGHTS[::-1], change=lambda n, d: image(
        n, np.minimum(RAMP // 4, 255), (-30, -24, HEIGHTS[::-1][n]), modality="US", bits=8),
       volume=[*at, (300 + 30) // 4])
    c, s = np.cos(0.35), np.sin(0.35)
    # MR turned about x: a column runs along x, a row along (0, c, s), slices along (0, −s, c).
    ct("mr_oblique", modality="MR", orientation=(1, 0, 0, 0, c, s),
       place=lambda z: (-30, -24 * c - z * s, -24 * s + z * c),
       volume=[0, -((20 - 24) * c - 12 * s), (20 - 24) * s + 12 * c, value])
    # Gantry tilt: the table moves along z, the images lean.
    ct("ct_gantry_tilt", orientation=(1, 0, 0, 0, c, s), place=lambda z: (-30, -24 * c, -24 * s + z),
       volume=[0, -((20 - 24) * c), (20 - 24) * s + 12, value])
    ct("ct_shifted_slice", place=lambda z: (-30 + (4 if z == 12 else 0), -24, z),
       says=["image_04.dcm", "(0020,0032)"])
    ct("ct_missing_slice", change=lambda n, d: None if n == 5 else d,
       says=["1 slices are missing"], volume=[0, 4, 15, value + 7])
    ct("ct_slice_twice", heights=[*HEIGHTS, 12.0], says=["image_", "(0020,0032)", "one place"])
    ct("ct_all_in_one_place", heights=[6.0, 6.0, 6.0], says=["image_", "(0020,0032)", "one place"])
    ct("ct_uneven", heights=[0, 3, 6, 9, 13, 16, 19.0], says=["image_04.dcm", "(0020,0032)", "4 mm from"])

    def set_in_4(attribute, content):
        def change(n, data):
            if n == 4:
                setattr(data, attribute, content)
            return data
        return change
    ct("ct_spacing_differs", change=set_in_4("PixelSpacing", [2, 1.5]), volume=[*at, value],
       says=["1 images of another", "1 slices are"])
    ct("ct_frame_differs", change=set_in_4("FrameOfReferenceUID", OTHER), volume=[*at, value],
       says=["1 images of another", "1 slices are"])
    ct("ct_slope_no_number", change=set_in_4("RescaleSlope", "1e300"), says=["image_04.dcm", "(0028,1053)"])

    def palette(n, data):
        data.PhotometricInterpretation = "PALETTE COLOR"
        return data
    ct("us_palette", change=palette, says=["image_00.dcm", "(0028,0004)", "PALETTE COLOR"])

    def many(n, data):
        data.NumberOfFrames, data.PixelData = 3, data.PixelData * 3
        return data
    ct("us_multi_frame", change=many, says=["image_00.dcm", "(0028,0008)"])
    ct("ct_high_bit", change=lambda n, d: (setattr(d, "BitsStored", 12), setattr(d, "HighBit", 20), d)[-1],
       says=["image_00.dcm", "(0028,0102)"])

    # A longer series of another examination, in another frame: the structures' one is taken.
    into = case("other_series", cc=whole, volume=[*at, value], says=["frame"])
    series(into)
    for n in range(20):
        save(image(n, RAMP, (0, 0, n), modality="MR", series="other", frame=OTHER), into / f"other_{n:02}.dcm")
    ct("only_another_frame", frame=OTHER, says=["another frame of reference"])

    # A dose of 20 × 8 × 10 voxels of 2, 3 and 5 mm whose value is 1 + its frame's place along the patient's axis.
    for name, orientation, axis, sign in (("z", (1, 0, 0, 0, 1, 0), 2, 1), ("z_flipped", (1, 0, 0, 0, -1, 0), 2, -1),
                                          ("y", (1, 0, 0, 0, 0, -1), 1, 1), ("y_flipped", (1, 0, 0, 0, 0, 1), 1, -1),
                                          ("x", (0, 1, 0, 0, 0, 1), 0, 1), ("x_flipped", (0, 1, 0, 0, 0, -1), 0, -1)):
        for absolute in (False, True):
            for down in (1, -1):
                data = new_set("RTDOSE", name, absolute, down)
                position = np.array([-20.0, -15, 7])
                offsets = 5.0 * down * np.arange(10)
                frames = position[axis] + (offsets if absolute else sign * offsets)
                data.FrameOfReferenceUID, data.DoseUnits, data.DoseGridScaling = FRAME, "GY", "0.01"
                data.ImagePositionPatient, data.ImageOrientationPatient = list(position), list(orientation)
                data.PixelSpacing, data.Rows, data.Columns, data.NumberOfFrames = [3, 2], 8, 20, 10
                data.GridFrameOffsetVector = list(position[axis] + offsets if absolute else offsets)
                data.SamplesPerPixel, data.PhotometricInterpretation = 1, "MONOCHROME2"
                data.BitsAllocated, data.BitsStored, data.HighBit, data.PixelRepresentation = 16, 16, 15, 0
                data.PixelData = np.repeat(np.round(100 * (frames + 100)), 160).astype("<u2").tobytes()
                way = np.cross(orientation[:3], orientation[3:])
                u, v = np.array(orientation[:3]), np.array(orientation[3:])
                assert way[axis] == sign
                at = position + 2 * 4 * u + 3 * 2 * v
                at[axis] = frames[3]
                into = case(f"dose_{name}_{'absolute' if absolute else 'relative'}_{'up' if down > 0 else 'down'}",
                            cc=whole, dose=[-at[0], -at[1], at[2], frames[3] + 100])
                save(data, into / "rtdose.dcm")
                save(rois(gland()), into / "rtstruct.dcm")

    # Seeds after an implant, on no template, of two strengths, some with their directions.
    random = np.random.default_rng(4)
    for name, isotope, number, tilted in (("seeds_day_30", "I-125", 6711, True), ("seeds_day_0", "Cs-131", 131, False)):
        sources = [(isotope, 0.5), (isotope, 0.625)]
        seeds = [(int(random.integers(1, 3)), np.append(random.uniform(-12, 12, 2), random.uniform(2, 30)).round(4),
                  random.normal(size=3) if tilted and n % 3 else None) for n in range(50)]
        axes = [(0, 0, 1) if axis is None else axis / np.linalg.norm(axis) for _, _, axis in seeds]
        folder = case(name, cc=whole, says=["its seeds are in seeds.csv"],
                      seeds=[[-at[0], -at[1], at[2], -u[0], -u[1], u[2], number, sources[source - 1][1]]
                             for (source, at, _), u in zip(seeds, axes)])
        save(rois(gland()), folder / "rtstruct.dcm")
        save(implant(seeds, sources), folder / "rtplan.dcm")

    # Label maps.
    labels = np.zeros((30, 40, 50), np.uint8)
    labels[5:25, 5:35, 5:45] = 1  # 40 × 30 × 20 mm
    one = labels.copy()
    one[2, 2, 2] = 2
    nrrd(case("one_voxel", refused=["no structure is called", "label_1", "label_2", "--gland"]) / "map.nrrd", one)
    place = ((-10, -20, 0), (1, 1, 1))
    far = ((-10, -20, 53), (1, 1, 1))
    nifti(case("nifti_qform", cc={"prostate": 24.0}) / "m.nii.gz", labels, qform=place)
    nifti(case("nifti_both", cc={"prostate": 24.0}) / "m.nii.gz", labels, sform=place, qform=place)
    nifti(case("nifti_sform_elsewhere", cc={"prostate": 24.0}, says=["qform_code", "53 mm"]) / "m.nii.gz", labels,
          sform=place, qform=far)
    nifti(case("nifti_metres", cc={"prostate": 24.0}) / "m.nii.gz", labels,
          sform=((-0.01, -0.02, 0), (0.001, 0.001, 0.001)), units=1)
    nifti(case("nifti_units", refused=["m.nii.gz", "xyzt_units"]) / "m.nii.gz", labels, sform=place, units=5)
    nifti(case("nifti_all_units", refused=["m.nii.gz", "xyzt_units"]) / "m.nii.gz", labels, sform=place, units=255)
    two = np.stack([labels, labels])
    nifti(case("nifti_4d", refused=["m.nii.gz", "dim", "3-D"]) / "m.nii.gz", two, sform=place,
          dim=(4, 50, 40, 30, 2, 1, 1, 1))
    nifti(case("nifti_cut_gzip", refused=["m.nii.gz", "cut"]) / "m.nii.gz", labels, sform=place, cut=40)
    nifti(case("nifti_cut", refused=["m.nii", "cut"]) / "m.nii", labels, sform=place, cut=40, pack=False)
    nifti(case("nifti_empty", refused=["no structure"]) / "m.nii", 0 * labels, sform=place, pack=False)
    nrrd(case("nrrd_detached", refused=["map.nhdr", "data file"]) / "map.nhdr", labels, "data file: map.raw\n",
         data=b"")
    nrrd(case("nrrd_cut_gzip", refused=["map.nrrd", "cut"]) / "map.nrrd", labels, encoding="gzip",
         data=gzip.compress(labels.tobytes())[:-30])
    nrrd(case("nrrd_bzip2", refused=["map.nrrd", "encoding"]) / "map.nrrd", labels, encoding="bzip2")
    nrrd(case("nrrd_float_labels", cc={"prostate": 24.0}) / "map.nrrd", labels.astype("<f4"),
         kind="float")
    (out / "cases.json").write_text(json.dumps(cases))


if __name__ == "__main__":
    main()
