#!/usr/bin/python3
"""Puts a series of images beside an RTSTRUCT: a ramp of grey along x, a bright ball in the middle of the gland.

usage: make_image_series.py EXPORT OUT MODALITY
reads EXPORT/rtstruct.dcm, writes OUT/rtstruct.dcm and OUT/image_NNN.dcm
"""

import pathlib
import shutil
import sys

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, generate_uid

CLASSES = {"US": "1.2.840.10008.5.1.4.1.1.6.1", "CT": "1.2.840.10008.5.1.4.1.1.2", "MR": "1.2.840.10008.5.1.4.1.1.4"}
STEP_MM, SLICE_MM, SIDE, SLICES = 1.0, 2.5, 100, 36


def main():
    export, out, modality = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    out.mkdir(parents=True)
    shutil.copy(export / "rtstruct.dcm", out)
    structures = pydicom.dcmread(export / "rtstruct.dcm")
    frame = structures.StructureSetROISequence[0].ReferencedFrameOfReferenceUID
    points = np.concatenate([np.reshape(contour.ContourData, (-1, 3)).astype(float)
                             for contour in structures.ROIContourSequence[0].ContourSequence])
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))  # LPS
    corner = middle - 0.5 * np.array([STEP_MM * (SIDE - 1), STEP_MM * (SIDE - 1), SLICE_MM * (SLICES - 1)])
    bits, most = (8, 255) if modality == "US" else (16, 2000)
    series = generate_uid(entropy_srcs=["series", modality])
    x, y = np.meshgrid(STEP_MM * np.arange(SIDE), STEP_MM * np.arange(SIDE))
    for n in range(SLICES):
        z = SLICE_MM * n
        values = 0.5 * most * x / x.max()
        away = corner - middle
        far = np.sqrt((away[0] + x) ** 2 + (away[1] + y) ** 2 + (away[2] + z) ** 2)
        values[far < 8] = most
        image = Dataset()
        image.file_meta = FileMetaDataset()
        image.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        image.SOPClassUID = image.file_meta.MediaStorageSOPClassUID = CLASSES[modality]
        uid = generate_uid(entropy_srcs=["image", modality, str(n)])
        image.SOPInstanceUID = image.file_meta.MediaStorageSOPInstanceUID = uid
        image.Modality, image.SeriesInstanceUID, image.FrameOfReferenceUID = modality, series, frame
        image.PatientName = "Doe^Jane"
        image.ImagePositionPatient = [round(float(v), 6) for v in corner + [0, 0, z]]
        image.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
        image.PixelSpacing = [STEP_MM, STEP_MM]
        image.SliceThickness = SLICE_MM
        image.Rows = image.Columns = SIDE
        image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
        image.BitsAllocated = image.BitsStored = bits
        image.HighBit, image.PixelRepresentation = bits - 1, 0
        image.PixelData = np.round(values).astype("<u1" if bits == 8 else "<u2").tobytes()
        image.save_as(out / f"image_{n:03}.dcm", write_like_original=False)


main()
