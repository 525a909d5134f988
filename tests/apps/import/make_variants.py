#!/usr/bin/python3
"""DICOM RT files and label maps of the phantom in many forms, for the tests of `brachy import`. Made of an export of
`brachy export --dicom` by pydicom and numpy; never committed.

usage: make_variants.py EXPORT OUT     writes OUT/NAME/… and OUT/variants.json: {"NAME": {"good": true} or
{"refused": ["words of the message", …]}}
       make_variants.py --seeds EXPORT CORPUS     writes first inputs of the fuzz targets rt_structure, rt_plan,
rt_dose, label_nrrd and label_nifti, some hundred bytes each: CORPUS/TARGET/NAME
"""
import gzip
import json
import pathlib
import shutil
import struct
import sys

import numpy as np
import pydicom
from pydicom.uid import (DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian, ImplicitVRLittleEndian, RLELossless,
                         generate_uid)

NAMES = ("rtstruct.dcm", "rtplan.dcm", "rtdose.dcm")


def turned(structures, R, shift):
    for roi in structures.ROIContourSequence:
        for contour in roi.ContourSequence:
            points = np.array(contour.ContourData, float).reshape(-1, 3) @ R.T + shift
            contour.ContourData = [f"{v:.6f}" for v in points.ravel()]


def box_map(spacing, size, half):
    """A box of half sizes `half` about the middle of a map, as labels; k, j, i."""
    k, j, i = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in size[::-1]), indexing="ij")
    return ((abs(i * spacing[0]) < half[0]) & (abs(j * spacing[1]) < half[1]) & (abs(k * spacing[2]) < half[2]))


def nrrd(path, labels, directions, origin, extra="", encoding="raw", kind="unsigned char"):
    space = "left-posterior-superior"
    sizes = " ".join(str(n) for n in labels.shape[::-1])
    vectors = " ".join("(" + ",".join(repr(float(v)) for v in d) + ")" for d in directions)
    head = (f"NRRD0004\ntype: {kind}\ndimension: 3\nspace: {space}\nsizes: {sizes}\nspace directions: {vectors}\n"
            f"kinds: domain domain domain\nendian: little\nencoding: {encoding}\n"
            f"space origin: ({','.join(repr(float(v)) for v in origin)})\n{extra}\n")
    data = labels.tobytes()
    path.write_bytes(head.encode() + (gzip.compress(data) if encoding == "gzip" else data))


def nifti(path, labels, affine, big=False):
    e = ">" if big else "<"
    header = bytearray(352)
    struct.pack_into(e + "i", header, 0, 348)
    struct.pack_into(e + "8h", header, 40, 3, *labels.shape[::-1], 1, 1, 1, 1)
    struct.pack_into(e + "hh", header, 70, 4, 16)
    struct.pack_into(e + "8f", header, 76, 1, 1, 1, 1, 1, 1, 1, 1)
    struct.pack_into(e + "f", header, 108, 352)
    struct.pack_into(e + "hh", header, 252, 0, 1)
    for row in range(3):
        struct.pack_into(e + "4f", header, 280 + 16 * row, *affine[row])
    header[344:348] = b"n+1\0"
    path.write_bytes(gzip.compress(bytes(header) + labels.astype(e + "i2").tobytes()))


SEED_SYNTAXES = {"explicit": None, "implicit": ImplicitVRLittleEndian, "big_endian": ExplicitVRBigEndian,
                 "deflated": DeflatedExplicitVRLittleEndian}


def bare(data, keep):
    """Nothing but what is read."""
    for element in list(data):
        if element.keyword not in ("Modality", "SOPClassUID", "SOPInstanceUID", *keep):
            del data[element.tag]


def small_sets(export):
    """The export's three objects, as short as they can be."""
    structures, plan, dose = (pydicom.dcmread(export / n) for n in NAMES)
    bare(structures, ("StructureSetROISequence", "ROIContourSequence"))
    structures.StructureSetROISequence = structures.StructureSetROISequence[:1]
    structures.ROIContourSequence = structures.ROIContourSequence[:1]
    roi = structures.ROIContourSequence[0]
    contours = list(roi.ContourSequence)[::max(1, len(roi.ContourSequence) // 3)][:3]
    for n, contour in enumerate(contours):
        if "ContourImageSequence" in contour:
            del contour.ContourImageSequence
        z = 2 * n
        contour.ContourData = [-9, -9, z, 9, -9, z, 9, 9, z, 0, 11, z, -9, 9, z]
        contour.NumberOfContourPoints = 5
    roi.ContourSequence = pydicom.Sequence(contours)
    bare(plan, ("FrameOfReferenceUID", "BrachyTreatmentTechnique", "BrachyTreatmentType", "RTPlanDescription",
                "SourceSequence", "ApplicationSetupSequence"))
    plan.ApplicationSetupSequence = plan.ApplicationSetupSequence[:2]
    for setup in plan.ApplicationSetupSequence:
        setup.ChannelSequence = setup.ChannelSequence[:2]
    bare(dose, ("FrameOfReferenceUID", "ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "DoseUnits",
                "DoseGridScaling", "SamplesPerPixel", "PhotometricInterpretation", "PixelRepresentation"))
    dose.Rows, dose.Columns, dose.NumberOfFrames = 3, 4, 2
    dose.GridFrameOffsetVector = [0, 2]
    dose.BitsAllocated, dose.BitsStored, dose.HighBit = 16, 16, 15
    dose.PixelData = np.arange(24, dtype="<u2").tobytes()
    return {"rt_structure": structures, "rt_plan": plan, "rt_dose": dose}


def seeds(export, corpus):
    for target in ("rt_structure", "rt_plan", "rt_dose", "label_nrrd", "label_nifti"):
        (corpus / target).mkdir(parents=True, exist_ok=True)
    scratch = corpus / "scratch"

    def store(target, name, data, uid):
        if uid:
            data.file_meta.TransferSyntaxUID = uid
            data.is_little_endian = uid != ExplicitVRBigEndian
            data.is_implicit_VR = uid == ImplicitVRLittleEndian
        data.save_as(scratch)
        (corpus / target / name).write_bytes(scratch.read_bytes()[132:])  # a target adds preamble and "DICM"

    for name, uid in SEED_SYNTAXES.items():
        for target, data in small_sets(export).items():
            if target == "rt_dose" and name == "big_endian":
                data.PixelData = np.arange(24, dtype=">u2").tobytes()
            store(target, name, data, uid)
    packed = small_sets(export)["rt_dose"]
    packed.compress(RLELossless)
    store("rt_dose", "rle", packed, None)
    wide = small_sets(export)["rt_dose"]
    wide.BitsAllocated, wide.BitsStored, wide.HighBit = 32, 32, 31
    wide.PixelData = np.arange(24, dtype="<u4").tobytes()
    store("rt_dose", "wide", wide, None)

    # The first byte: whether the target compresses what follows.
    mask = box_map((1, 1, 1), (6, 5, 4), (2, 2, 1.5)).astype(np.uint8)
    keys = ("Segment0_ID:=Segment_1\nSegment0_Name:=Prostate\nSegment0_Color:=0.8 0.4 0.1\nSegment0_LabelValue:=1\n"
            "Segment0_Layer:=0\n")
    for name, labels, kind, encoding in (("bytes", mask, "uint8", "raw"), ("gzip", mask, "uint8", "gzip"),
                                         ("int64", mask.astype("<i8"), "int64", "raw"),
                                         ("double", mask.astype("<f8"), "double", "raw")):
        nrrd(scratch, labels, np.eye(3), np.zeros(3), keys if name == "gzip" else "", encoding, kind)
        (corpus / "label_nrrd" / name).write_bytes(b"\0" + scratch.read_bytes())
    layers = scratch.read_bytes().replace(b"dimension: 3", b"dimension: 4").replace(b"double", b"uint8")
    layers = layers.replace(b"sizes: 6 5 4", b"sizes: 2 3 5 4").replace(b"directions: ", b"directions: none ")
    layers = layers[:layers.index(b"\n\n") + 1] + keys.encode() + b"\n" + mask.tobytes()
    (corpus / "label_nrrd" / "layers").write_bytes(b"\0" + layers)
    (corpus / "label_nrrd" / "packed_layers").write_bytes(b"\1" + layers.replace(b"encoding: raw", b"encoding: gz"))
    for name, big in (("little", False), ("big", True)):
        nifti(scratch, mask, np.eye(4), big)
        (corpus / "label_nifti" / f"gzip_{name}").write_bytes(b"\0" + scratch.read_bytes())
        plain = gzip.decompress(scratch.read_bytes())
        for packed in (0, 1):
            (corpus / "label_nifti" / f"{name}{packed}").write_bytes(bytes([packed]) + plain)
    e = "<"
    second = bytearray(544)
    struct.pack_into(e + "i", second, 0, 540)
    second[4:12] = b"n+2\0\r\n\x1a\n"
    struct.pack_into(e + "hh", second, 12, 2, 8)
    struct.pack_into(e + "8q", second, 16, 3, 6, 5, 4, 1, 1, 1, 1)
    struct.pack_into(e + "8d", second, 104, 1, 1, 1, 1, 1, 1, 1, 1)
    struct.pack_into(e + "q", second, 168, 544)
    struct.pack_into(e + "ii", second, 344, 1, 0)
    struct.pack_into(e + "3d", second, 352, 0.1, 0.2, 0.3)
    (corpus / "label_nifti" / "second").write_bytes(b"\0" + bytes(second) + mask.tobytes())
    scratch.unlink()


def main():
    if sys.argv[1] == "--seeds":
        seeds(pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]))
        return
    export, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    variants = {}

    def folder(name, **expected):
        variants[name] = expected
        (out / name).mkdir(parents=True, exist_ok=True)
        return out / name

    def files(name, change, which=NAMES, only=NAMES, **expected):
        """The files `which` of the export after change(rtstruct, rtplan, rtdose), which changes the files `only`. The
        others are the export's: pydicom takes half a second to write its contours."""
        sets = [pydicom.dcmread(export / n) for n in NAMES]
        change(*sets)
        into = folder(name, **expected)
        for data, file in zip(sets, NAMES):
            if file in which and file in only:
                data.save_as(into / file)
            elif file in which:
                shutil.copyfile(export / file, into / file)
        return into

    def syntax(uid):
        def change(*sets):
            for data in sets:
                data.file_meta.TransferSyntaxUID = uid
                data.is_little_endian = uid != ExplicitVRBigEndian
                data.is_implicit_VR = uid == ImplicitVRLittleEndian
        return change

    def big_endian(rs, rp, rd):
        syntax(ExplicitVRBigEndian)(rs, rp, rd)
        rd.PixelData = np.frombuffer(
            rd.PixelData, "<u4").astype(">u4").tobytes()

    def sixteen_bits(rs, rp, rd):
        dose = np.frombuffer(rd.PixelData, "<u4").astype(float) * float(rd.DoseGridScaling)
        # Doses next to a seed are cut, as planning systems do.
        scaling = 600 / 32767
        rd.PixelData = np.minimum(dose / scaling, 32767).round().astype("<i2").tobytes()
        rd.DoseGridScaling = f"{scaling:.10g}"
        rd.BitsAllocated, rd.BitsStored, rd.HighBit, rd.PixelRepresentation = 16, 16, 15, 1

    def encapsulated(rs, rp, rd):
        sixteen_bits(rs, rp, rd)
        rd.PixelRepresentation = 0
        rd.compress(RLELossless)

    def shuffled(rs, rp, rd):
        rng = np.random.default_rng(4)
        for roi in rs.ROIContourSequence:
            items = list(roi.ContourSequence)
            rng.shuffle(items)
            roi.ContourSequence = pydicom.Sequence(items)

    def oblique(rs, rp, rd):
        a = 0.3
        R = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        turned(rs, R, np.array([113.5, -240.25, 880.125]))

    def no_references(rs, rp, rd):
        for data in (rs, rp, rd):
            for name in ("ReferencedFrameOfReferenceSequence", "ReferencedStructureSetSequence",
                         "ReferencedRTPlanSequence", "FrameOfReferenceUID", "RTROIObservationsSequence"):
                if name in data:
                    delattr(data, name)
        for roi in rs.StructureSetROISequence:
            del roi.ReferencedFrameOfReferenceUID

    def every_third_gone(rs, rp, rd):
        for roi in rs.ROIContourSequence:
            count = len(roi.ContourSequence)
            roi.ContourSequence = pydicom.Sequence([c for n, c in enumerate(roi.ContourSequence)
                                                    if n % 3 != 1 or min(n, count - n) < 8])

    def first_alone(rs, rp, rd):
        rs.ROIContourSequence = rs.ROIContourSequence[:1]
        rs.StructureSetROISequence = rs.StructureSetROISequence[:1]

    # What must be read.
    files("plain", lambda *sets: None, good=True)
    files("implicit", syntax(ImplicitVRLittleEndian), good=True)
    files("deflated", syntax(DeflatedExplicitVRLittleEndian), good=True)
    files("big_endian", big_endian, good=True)
    files("sixteen_bits_signed", sixteen_bits, only=NAMES[2:], good=True)
    files("encapsulated", encapsulated, only=NAMES[2:], good=True)
    files("out_of_order", shuffled, only=NAMES[:1], good=True)
    files("oblique", oblique, which=NAMES[:1], good=True, turned=True)
    files("missing_references", no_references, good=True)
    files("missing_slices", every_third_gone, only=NAMES[:1], good=True)
    files("one_structure", first_alone, only=NAMES[:1], good=True)

    # Label maps of a box of 40 × 30 × 36 mm whose middle is at RAS (10, −20, 30).
    middle = np.array([-10.0, 20.0, 30.0])  # LPS
    spacing, size = (0.5, 0.75, 1.5), (100, 60, 40)
    mask = box_map(spacing, size, (20, 15, 18)).astype(np.uint8)
    half = (np.array(size) - 1) / 2
    a = 0.4
    R = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    for name, directions in (("map_straight", np.diag(spacing)), ("map_oblique", (R * spacing).T)):
        nrrd(folder(name, good=True, box=True, cc=43.2) / "map.nrrd", mask, directions, middle - half @ directions)
    directions = np.diag(spacing)
    # A segmentation that was cropped: the extent does not begin at 0, the origin is that of its first voxel.
    crop = mask[6:-4, 8:-6, 5:-7]
    nrrd(folder("map_cropped", good=True, box=True, cc=43.2) / "map.seg.nrrd", crop, directions,
         middle + (np.array([5, 8, 6]) - half) * spacing,
         "Segment0_ID:=Segment_1\nSegment0_Name:=Prostate\nSegment0_Color:=0.8 0.4 0.1\nSegment0_LabelValue:=1\n"
         "Segment0_Layer:=0\nSegment0_Extent:=5 92 8 53 6 35\nSegmentation_ReferenceImageExtentOffset:=5 8 6\n",
         "gzip")
    affine = np.eye(4)
    affine[:3, :3] = np.diag([-spacing[0], -spacing[1], spacing[2]])
    affine[:3, 3] = np.array([10, -20, 30]) - affine[:3, :3] @ half
    for name, big in (("nifti", False), ("nifti_big_endian", True)):
        nifti(folder(name, good=True, box=True, cc=43.2) / "map.nii.gz", mask, affine, big)

    # What must be refused, by a line that names the tag; a dose in another frame and a wrong count are left.
    def wrong_frame(rs, rp, rd):
        rd.FrameOfReferenceUID = generate_uid(entropy_srcs=["other"])

    def change_contour(change):
        return lambda rs, rp, rd: change(rs.ROIContourSequence[0].ContourSequence[3])

    def set_value(index, attribute, value):
        def change(*sets):
            setattr(sets[index], attribute, value)
        return change

    def drop(index, attribute):
        def change(*sets):
            delattr(sets[index], attribute)
        return change

    files("wrong_frame", wrong_frame, only=NAMES[2:], good=True)
    files("no_contour_triples", change_contour(lambda c: setattr(c, "ContourData", list(c.ContourData)[:-1])),
          only=NAMES[:1], refused=["rtstruct.dcm", "(3006,0050)"])
    files("wrong_point_count", change_contour(lambda c: setattr(c, "NumberOfContourPoints", 7)),
          only=NAMES[:1], good=True)

    def bend(contour):
        values = [float(v) for v in contour.ContourData]
        values[2] += 5
        contour.ContourData = values
    files("contour_off_its_plane", change_contour(bend), only=NAMES[:1],
          refused=["rtstruct.dcm", "(3006,0050)", "plane"])
    files("no_structures", drop(0, "StructureSetROISequence"), only=NAMES[:1], refused=["rtstruct.dcm", "(3006,0020)"])
    files("dose_without_scaling", drop(2, "DoseGridScaling"), only=NAMES[2:], refused=["rtdose.dcm", "(3004,000e)"])
    files("dose_relative", set_value(2, "DoseUnits", "RELATIVE"), only=NAMES[2:], refused=["rtdose.dcm", "(3004,0002)"])
    files("dose_without_pixels", drop(2, "PixelData"), only=NAMES[2:], refused=["rtdose.dcm", "(7fe0,0010)"])
    files("dose_too_short", lambda rs, rp, rd: setattr(rd, "PixelData", rd.PixelData[:-1000]),
          only=NAMES[2:], refused=["rtdose.dcm", "(7fe0,0010)"])
    files("dose_uneven", lambda rs, rp, rd: rd.GridFrameOffsetVector.__setitem__(3, 99),
          only=NAMES[2:], refused=["rtdose.dcm", "(3004,000c)"])
    files("plan_without_sources", drop(1, "SourceSequence"), only=NAMES[1:2], refused=["rtplan.dcm", "(300a,0210)"])

    def no_position(rs, rp, rd):
        del rp.ApplicationSetupSequence[2].ChannelSequence[0].BrachyControlPointSequence[1].ControlPoint3DPosition
    files("plan_without_positions", no_position, only=NAMES[1:2], refused=["rtplan.dcm", "(300a,02d4)"])
    files("plan_of_iridium", lambda rs, rp, rd: (setattr(rp.SourceSequence[0], "SourceIsotopeName", "Ir-192"),
                                                  setattr(rp.SourceSequence[0], "SourceModelID", "mHDR")),
          only=NAMES[1:2], refused=["rtplan.dcm", "(300a,0210)", "Ir-192"])
    whole = (export / NAMES[0]).read_bytes()
    for name, share in (("truncated", 0.6), ("truncated_early", 0.02)):
        (folder(name, refused=["rtstruct.dcm"]) / NAMES[0]).write_bytes(whole[:int(share * len(whole))])
    (folder("no_dicom", refused=["text.dcm"]) / "text.dcm").write_text("not DICOM\n" * 50)
    map_folder = folder("map_truncated", refused=["map.nrrd", "sizes"])
    nrrd(map_folder / "map.nrrd", mask[:-1], directions, middle)
    text = (map_folder / "map.nrrd").read_bytes().replace(b"100 60 39", b"100 60 40")
    (map_folder / "map.nrrd").write_bytes(text)
    nrrd(folder("map_flat", refused=["map.nrrd", "space directions"]) / "map.nrrd", mask,
         np.array([[1, 0, 0], [0, 1, 0], [1, 1, 0]]), middle)
    nrrd(folder("map_is_image", refused=["map.nrrd", "image"]) / "map.nrrd",
         (mask.astype(np.int16) - 5), directions, middle, kind="short")
    (out / "variants.json").write_text(json.dumps(variants))


if __name__ == "__main__":
    main()
