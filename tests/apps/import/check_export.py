#!/usr/bin/python3
"""An export of `brachy export --dicom` by an independent reader: pydicom and numpy, nothing of ours.

usage: check_export.py DIR PRESCRIPTION_GY     prints JSON: for each structure its volume by the contours (even-odd, on
a raster of its own, slab by slab), and D90, V100, D30 from the RTDOSE at the raster's points; seeds and strength of the
RTPLAN.
"""
import json
import pathlib
import sys

import numpy as np
import pydicom


def polygons_of(roi):
    planes = {}
    for contour in roi.ContourSequence:
        points = np.array(contour.ContourData, float).reshape(-1, 3)
        planes.setdefault(round(points[0, 2], 4), []).append(points[:, :2])
    return dict(sorted(planes.items()))


def inside(polygons, x, y):
    """Even-odd over all polygons, for the grid x × y (y rows)."""
    result = np.zeros((len(y), len(x)), bool)
    for polygon in polygons:
        a, b = polygon, np.roll(polygon, -1, axis=0)
        for (ax, ay), (bx, by) in zip(a, b):
            if ay == by:
                continue
            rows = (y >= min(ay, by)) & (y < max(ay, by))
            if not rows.any():
                continue
            at = ax + (y[rows] - ay) / (by - ay) * (bx - ax)
            result[rows] ^= x[None, :] >= at[:, None]
    return result


def dose_at(dose, points):
    """1/sqrt(dose) trilinear between the voxels; NaN outside."""
    grid = dose.pixel_array.astype(float) * float(dose.DoseGridScaling)
    origin = np.array(dose.ImagePositionPatient, float)
    spacing = np.array([dose.PixelSpacing[1], dose.PixelSpacing[0],
                        dose.GridFrameOffsetVector[1] - dose.GridFrameOffsetVector[0]], float)
    index = (points - origin) / spacing
    top = np.array(grid.shape[::-1]) - 1
    outside = ((index < -0.5) | (index > top + 0.5)).any(axis=1)
    index = np.clip(index, 0, top - 1e-9)
    low = index.astype(int)
    part = index - low
    total = 0
    for corner in range(8):
        bits = np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1])
        weight = np.prod(np.where(bits, part, 1 - part), axis=1)
        at = low + bits
        total = total + weight / np.sqrt(np.maximum(grid[at[:, 2], at[:, 1], at[:, 0]], 1e-12))
    result = 1 / total ** 2
    result[outside] = np.nan
    return result


def main():
    folder, prescription = pathlib.Path(sys.argv[1]), float(sys.argv[2])
    structures = pydicom.dcmread(folder / "rtstruct.dcm")
    dose = pydicom.dcmread(folder / "rtdose.dcm")
    plan = pydicom.dcmread(folder / "rtplan.dcm")
    names = {r.ROINumber: r.ROIName for r in structures.StructureSetROISequence}
    report = {"structures": {}}
    for roi in structures.ROIContourSequence:
        planes = polygons_of(roi)
        heights = np.array(list(planes))
        middles = (heights[1:] + heights[:-1]) / 2
        edges = np.concatenate([[heights[0] - (middles[0] - heights[0])], middles,
                                [heights[-1] + (heights[-1] - middles[-1])]])
        every = np.concatenate([np.concatenate(p) for p in planes.values()])
        low, high = every.min(axis=0), every.max(axis=0)
        # About a quarter of a millimetre, finer for a small structure.
        step = min(0.25, (high - low).min() / 40)
        x, y = (np.arange(low[k] + step / 2, high[k] + step, step) for k in (0, 1))
        doses, weights = [], []
        for n, (z, polygons) in enumerate(planes.items()):
            mask = inside(polygons, x, y)
            rows, columns = np.nonzero(mask)
            points = np.stack([x[columns], y[rows], np.full(len(rows), z)], axis=1)
            doses.append(dose_at(dose, points))
            weights.append(np.full(len(rows), step * step * (edges[n + 1] - edges[n])))
        doses, weights = np.concatenate(doses), np.concatenate(weights)
        volume = weights.sum()
        held = ~np.isnan(doses)
        doses, weights = doses[held], weights[held]
        order = np.argsort(-doses)
        share = np.cumsum(weights[order]) / weights.sum()
        at = lambda percent: float(doses[order][np.searchsorted(share, percent / 100)])
        report["structures"][names[roi.ReferencedROINumber]] = {
            "volume_cc": volume / 1000, "d90_gy": at(90), "d30_gy": at(30),
            "v100_percent": 100 * weights[doses >= prescription].sum() / weights.sum()}
    channels = [c for s in plan.ApplicationSetupSequence for c in s.ChannelSequence]
    report["needles"] = len(plan.ApplicationSetupSequence)
    report["seeds"] = len(channels)
    report["strength_u"] = float(plan.SourceSequence[0].ReferenceAirKermaRate)
    report["positions_lps"] = [[float(v) for v in c.BrachyControlPointSequence[0].ControlPoint3DPosition]
                               for c in channels]
    print(json.dumps(report))


if __name__ == "__main__":
    main()
