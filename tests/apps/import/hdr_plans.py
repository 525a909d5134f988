#!/usr/bin/python3
"""HDR plans as other planning systems write them, with analytic truth: `brachy import` and `check-dose` are judged by
an independent reading and an independent TG-43 sum in numpy.

usage: hdr_plans.py BRACHY_IMPORT SOURCES [COUNT [FIRST]]     default: 24 cases from number 0; exits with 1 if any fails

SOURCES: config/sources. Each case draws catheters (straight or curved, oblique, 4 to 14), a source (named or not), time
weights (seconds, shares or totals; running on, with the source's way between positions, or from 0 at each position),
relative positions (from the tip, from the first dwell, negative, from the other end), the order of the control points,
decimal strings of up to 19 characters, structures of the catheters (by number, out of order, missing) and a dose. Some
doses are wrong on purpose: a grid moved by a millimetre, end frames of another dose, decay counted twice, another
source table, several fractions, a grid that ends inside an organ; some files are malformed and must be refused in one
line. Truth: positions to 0.1 mm, times to 0.01 %, root mean square of a right dose below 0.3 %, a shift to 0.15 mm.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

try:
    import numpy as np
    import pydicom
    import tomllib
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.sequence import Sequence
except ImportError as missing:
    print(f"hdr_plans: {missing}; install python3-pydicom", file=sys.stderr)
    sys.exit(77)
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "reference/dose"))
from tg43_numpy import Source  # noqa: E402

pydicom.config.settings.writing_validation_mode = pydicom.config.IGNORE

MODELS = {"mhdr-v2": ("Nucletron", "microSelectron-v2"), "gammamed-hdr": ("Varian", "GammaMed Plus"),
          "flexisource": ("Elekta", "Flexisource"), "vs2000": ("Varian", "VS2000")}
WRONG = ["shift", "ends", "decay", "source", "fractions", "outside"]
MALFORMED = ["odd", "falling", "private", "no time", "no dwell", "cobalt", "no positions", "far"]
DESCENDING = -1


def lps(p):
    return np.array([-p[0], -p[1], p[2]])


def decimal(value, digits):
    return f"{value:.{digits}f}"


class Catheter:
    """A curve through the perineum, and dwells from the tip backwards."""

    def __init__(self, rng, n):
        self.name = f"{'ABCDEFGHIJKLMN'[n]}{rng.integers(1, 9)}.5"
        self.entry = np.array([rng.uniform(-20, 20), rng.uniform(-15, 15), -60.0])
        self.lean = np.array([rng.uniform(-0.15, 0.15), rng.uniform(-0.15, 0.15), 0])
        self.bend = np.array([rng.uniform(-1, 1), rng.uniform(-1, 1), 0]) * rng.choice([0, 0.0015])
        self.tip_z = rng.uniform(15, 30)
        count, self.first_mm = int(rng.integers(3, 14)), rng.uniform(4, 8)
        self.dwells, self.axes, self.offsets = [], [], []
        fine = [self.at(z) for z in np.arange(self.tip_z, -60, -0.01)]
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
        for k in range(count):
            i = int(np.searchsorted(along, self.first_mm + 5 * k))
            axis = fine[i - 1] - fine[i + 1]
            self.dwells.append(fine[i])
            self.axes.append(axis / np.linalg.norm(axis))
            self.offsets.append(along[i])
        self.seconds = np.round(rng.uniform(0, 12, count) * (rng.random(count) > 0.2), 1)
        if not self.seconds.any():
            self.seconds[0] = 3.0

    def at(self, z):
        h = z + 60
        return self.entry + self.lean * h + self.bend * h * h + np.array([0, 0, h])


class Case:
    def __init__(self, sources, number):
        rng = self.rng = np.random.default_rng(number)
        self.source_name = str(rng.choice(list(MODELS)))
        self.source = sources[self.source_name]
        self.wrong = WRONG[number // 2 % len(WRONG)] if number % 4 == 2 else None
        self.malformed = MALFORMED[number // 4 % len(MALFORMED)] if number % 4 == 3 else None
        self.catheters = [Catheter(rng, n) for n in range(int(rng.integers(4, 14)))]
        self.strength = float(rng.uniform(20000, 45000))
        self.is_named = self.wrong == "source" or rng.random() < 0.7
        self.weights = str(rng.choice(["seconds", "shares", "totals"]))
        self.running = str(rng.choice(["on", "with way", "from 0"]))
        self.relative = str(rng.choice(["tip", "first", "negative", "other end"]))
        self.order = int(rng.choice([1, DESCENDING]))
        self.structures = str(rng.choice(["number", "shuffled", "none"]))
        self.digits = int(rng.choice([2, 6, 15]))
        self.shift = np.zeros(3)
        if self.wrong == "shift":
            self.shift = rng.uniform(0.6, 1.5) * np.eye(3)[rng.integers(0, 3)] * rng.choice([-1, 1])

    def dose_at(self, points, source):
        total = np.zeros(len(points))
        for c in self.catheters:
            for position, axis, seconds in zip(c.dwells, c.axes, c.seconds):
                if seconds > 0:
                    total += source.rate(points, position, axis) * self.strength * seconds / 3600 / 100
        return total

    def control_points(self, c):
        order = range(len(c.dwells)) if self.order == 1 else reversed(range(len(c.dwells)))
        whole = {"seconds": c.seconds.sum(), "shares": 100.0, "totals": 1e3 * c.seconds.sum()}[self.weights]
        scale, weight, out = whole / c.seconds.sum(), 0.0, []
        last = {"tip": 0.0, "first": c.offsets[0], "negative": c.offsets[0] + 6.5, "other end": 0.0}[self.relative]
        for k in order:
            begin = weight if self.running != "from 0" else 0.0
            relative = c.offsets[k] - last if self.relative != "other end" else 130 - c.offsets[k]
            for w in (begin, begin + scale * c.seconds[k]):
                point = Dataset()
                point.ControlPointIndex = len(out)
                point.CumulativeTimeWeight = decimal(w, 6)
                point.ControlPointRelativePosition = decimal(relative, 3)
                point.ControlPoint3DPosition = [decimal(v, self.digits) for v in lps(c.dwells[k])]
                out.append(point)
            weight = begin + scale * c.seconds[k]
            if self.running == "with way":
                weight += 0.001 * whole
        return out, weight - (0.001 * whole if self.running == "with way" else 0), whole

    def plan(self):
        data = Dataset()
        data.Modality, data.SOPClassUID = "RTPLAN", "1.2.840.10008.5.1.4.1.1.481.5"
        data.BrachyTreatmentTechnique, data.BrachyTreatmentType = "INTERSTITIAL", "HDR"
        data.RTPlanDate, data.RTPlanLabel = "20240311", "plan"
        source = Dataset()
        source.SourceNumber, source.ReferenceAirKermaRate = 1, decimal(self.strength, 6)
        source.SourceIsotopeName, source.SourceIsotopeHalfLife = "Ir-192", "73.83"
        source.ActiveSourceLength = decimal(10 * self.source.L, 1)
        source.SourceStrengthReferenceDate, source.SourceStrengthReferenceTime = "20240201", "000000"
        if self.is_named:
            source.SourceManufacturer, source.SourceModelID = MODELS[self.source_name]
        if self.malformed == "cobalt":
            source.SourceIsotopeName, source.SourceModelID, source.SourceIsotopeHalfLife = "Co-60", "Co0", "1925"
        data.SourceSequence = Sequence([source])
        group, of_setup = Dataset(), Dataset()
        of_setup.BrachyApplicationSetupDose, of_setup.ReferencedBrachyApplicationSetupNumber = "15", 1
        group.FractionGroupNumber, group.NumberOfFractionsPlanned = 1, 1
        group.ReferencedBrachyApplicationSetupSequence = Sequence([of_setup])
        data.FractionGroupSequence = Sequence([group])
        setup = Dataset()
        setup.ApplicationSetupType, setup.ApplicationSetupNumber = "PERINEAL", 1
        setup.TotalReferenceAirKerma = decimal(
            self.strength * sum(c.seconds.sum() for c in self.catheters) / 3600, 4)
        channels = []
        for n, c in enumerate(self.catheters):
            channel = Dataset()
            channel.ChannelNumber, channel.SourceApplicatorID = n + 1, c.name
            channel.SourceMovementType, channel.ReferencedSourceNumber = "STEPWISE", 1
            points, last, whole = self.control_points(c)
            # The last weight stands for all of the time, the source's way included.
            final = last if self.running == "with way" else whole
            channel.ChannelTotalTime = decimal(c.seconds.sum() * final / whole, 6)
            channel.FinalCumulativeTimeWeight = decimal(final, 6)
            channel.BrachyControlPointSequence = Sequence(points)
            if self.structures == "number":
                channel.ReferencedROINumber = 10 + n
            channels.append(channel)
        first = channels[0].BrachyControlPointSequence
        if self.malformed == "odd":
            first.pop(1)
        elif self.malformed == "falling":
            first[0].CumulativeTimeWeight = "1e6"
        elif self.malformed == "no time":
            channels[0].ChannelTotalTime = "0"
        elif self.malformed == "no dwell":
            for channel in channels:
                for point in channel.BrachyControlPointSequence:
                    point.CumulativeTimeWeight = "0"
        elif self.malformed == "private":  # the catheters stand where only their system reads them
            for channel in channels:
                del channel.BrachyControlPointSequence
            courses = [Dataset() for _ in channels]
            for item in courses:
                item.add_new(0x0012, "LO", "a catheter as its system has it")
            data.private_block(0x300B, "VENDOR HDR", create=True).add_new(0x40, "SQ", Sequence(courses))
        elif self.malformed == "no positions":
            del first[0].ControlPoint3DPosition
        elif self.malformed == "far":
            first[0].ControlPoint3DPosition = ["1e9", "0", "0"]
        setup.ChannelSequence = Sequence(channels)
        data.ApplicationSetupSequence = Sequence([setup])
        return data

    def structure_set(self):
        data = Dataset()
        data.Modality, data.SOPClassUID = "RTSTRUCT", "1.2.840.10008.5.1.4.1.1.481.3"
        rois, contours = [], []

        def add(number, name, loops, kind):
            roi, item = Dataset(), Dataset()
            roi.ROINumber, roi.ROIName, roi.ReferencedFrameOfReferenceUID = number, name, "1.2.3.4"
            item.ReferencedROINumber, all_loops = number, []
            for loop in loops:
                contour = Dataset()
                contour.ContourGeometricType, contour.NumberOfContourPoints = kind, len(loop)
                contour.ContourData = [decimal(v, 3) for p in loop for v in lps(p)]
                all_loops.append(contour)
            item.ContourSequence = Sequence(all_loops)
            rois.append(roi)
            contours.append(item)

        t = np.linspace(0, 2 * np.pi, 40, endpoint=False)

        def ellipsoid(middle, half):
            loops = []
            for z in np.arange(middle[2] - half[2] + 1, middle[2] + half[2], 2.0):
                s = np.sqrt(max(0.0, 1 - ((z - middle[2]) / half[2]) ** 2))
                loops.append([(middle[0] + half[0] * s * np.cos(a), middle[1] + half[1] * s * np.sin(a), z) for a in t])
            return loops

        add(1, "Prostate", ellipsoid((0, 0, 0), (23, 17, 21)), "CLOSED_PLANAR")
        add(2, "Rectum", ellipsoid((0, -32, 0), (10, 9, 28)), "CLOSED_PLANAR")
        if self.structures != "none":
            order = list(range(len(self.catheters)))
            if self.structures == "shuffled":
                self.rng.shuffle(order)
            for n in order:
                c = self.catheters[n]
                line = [c.at(z) for z in np.linspace(c.tip_z, -60, 12)]
                add(10 + n, f"Needle {c.name}", [line if n % 2 else line[::-1]], "OPEN_NONPLANAR")
        data.StructureSetROISequence, data.ROIContourSequence = Sequence(rois), Sequence(contours)
        return data

    def dose(self, sources):
        step, size, origin = np.array([2.5, 2.5, 2.5]), np.array([32, 39, 26]), np.array([-39.0, -55.0, -32.0])
        if self.wrong == "outside":
            size, origin = np.array([32, 18, 26]), np.array([-39.0, -22.0, -32.0])
        k, j, i = np.meshgrid(*(np.arange(n) for n in size[::-1]), indexing="ij")
        points = origin + np.stack([i, j, k], -1).reshape(-1, 3) * step
        truth = self.source
        if self.wrong == "source":
            truth = sources["varisource"]
        # The file says that these values lie shift away from where they do.
        values = self.dose_at(points + self.shift, truth).reshape(size[::-1])
        if self.wrong == "ends":
            values[0] *= 0.4
            values[-1] *= 0.6
        elif self.wrong == "decay":
            values *= 0.5 ** (39 / self.source.half_life)
        elif self.wrong == "fractions":
            values *= 3
        values = np.minimum(values, 1000.0)
        near = np.min([np.linalg.norm(points - d, axis=1) for c in self.catheters for d in c.dwells], axis=0)
        counts = ((values.ravel() >= 2) & (near > 4.1)).reshape(values.shape).sum(axis=(1, 2))
        self.seen_ends = [f for f in (0, len(counts) - 1) if counts[f] >= 8]
        if self.wrong == "ends" and not self.seen_ends:
            self.wrong = None  # where nothing is compared
        data = Dataset()
        data.Modality, data.SOPClassUID = "RTDOSE", "1.2.840.10008.5.1.4.1.1.481.2"
        data.DoseUnits, data.DoseType, data.DoseSummationType = "GY", "PHYSICAL", "PLAN"
        # In LPS x and y run the other way: rows and columns are turned round.
        values = values[:, ::-1, ::-1]
        corner = lps(origin + step * np.array([size[0] - 1, size[1] - 1, 0]))
        if self.rng.random() < 0.5:
            offsets = step[2] * np.arange(size[2])
        else:  # frames from the other end, offsets descending
            values, corner = values[::-1], corner + np.array([0, 0, step[2] * (size[2] - 1)])
            self.seen_ends = [len(counts) - 1 - f for f in self.seen_ends]
            offsets = -step[2] * np.arange(size[2])
        data.ImagePositionPatient = [decimal(v, 4) for v in corner]
        data.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
        data.PixelSpacing = [step[1], step[0]]
        data.GridFrameOffsetVector = [decimal(v, 3) for v in offsets]
        data.Rows, data.Columns, data.NumberOfFrames = int(size[1]), int(size[0]), int(size[2])
        data.BitsAllocated = data.BitsStored = 32
        data.HighBit, data.PixelRepresentation, data.SamplesPerPixel = 31, 0, 1
        data.PhotometricInterpretation = "MONOCHROME2"
        scaling = values.max() / 4e9
        data.DoseGridScaling = f"{scaling:.10e}"
        data.PixelData = np.round(values / float(data.DoseGridScaling)).astype("<u4").tobytes()
        return data

    def write(self, folder, sources):
        for name, data in (("RP", self.plan()), ("RS", self.structure_set()), ("RD", self.dose(sources))):
            data.FrameOfReferenceUID, data.PatientName, data.PatientID = "1.2.3.4", "Phantom", "1"
            data.SOPInstanceUID = f"1.2.3.{abs(hash(name)) % 10 ** 8}"
            data.file_meta = FileMetaDataset()
            data.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
            data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
            data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
            data.is_little_endian, data.is_implicit_VR = True, False
            data.save_as(folder / f"{name}.dcm", write_like_original=False)


def along(course, offset):
    for a, b in zip(course, course[1:]):
        length = np.linalg.norm(b - a)
        if offset <= length + 1e-6:
            return a + offset / length * (b - a)
        offset -= length
    return course[-1]


def judge_import(case, out, faults):
    plan = tomllib.loads((out / "plan.toml").read_text())
    if len(plan["catheter"]) != len(case.catheters):
        faults.append(f"{len(plan['catheter'])} catheters for {len(case.catheters)}")
        return
    for c, written in zip(case.catheters, plan["catheter"]):
        course = np.array(written["course_mm"])
        if np.linalg.norm(course[0] - c.at(c.tip_z)) > np.linalg.norm(course[-1] - c.at(c.tip_z)):
            faults.append(f"{c.name}: its tip is at its other end")
        places = np.array([along(course, d) for d in written["dwell_mm"]])
        off = np.linalg.norm(places - np.array(c.dwells), axis=1).max() if len(places) == len(c.dwells) else np.inf
        if not off <= 0.1:
            faults.append(f"{c.name}: {len(places)} dwells for {len(c.dwells)}, {off:.3f} mm off")
        elif np.abs(np.array(written["dwell_s"]) - c.seconds).max() > 1e-4 * c.seconds.sum() + 1e-3:
            faults.append(f"{c.name}: times {written['dwell_s']} for {c.seconds}")
    kerma = plan["source_strength_u"] * sum(sum(c["dwell_s"]) for c in plan["catheter"]) / 3600
    true = case.strength * sum(c.seconds.sum() for c in case.catheters) / 3600
    if abs(kerma / true - 1) > 1e-4:
        faults.append(f"air kerma {kerma} for {true}")
    if case.is_named and plan["source"] != case.source_name:
        faults.append(f"source {plan['source']} for {case.source_name}")
    if plan["prescription_gy"] != 15:
        faults.append(f"prescription {plan['prescription_gy']}")


def judge_check(case, check, faults):
    found = " ".join(check["findings"])
    wanted = {"shift": "grid moved", "ends": "end frames", "decay": "is in it twice", "source": "another source table",
              "fractions": "fractions", "outside": "ends inside"}.get(case.wrong)
    if wanted and wanted not in found:
        faults.append(f"{case.wrong}: not found in {check['findings']}")
    others = {"source", "outside"} if case.wrong == "source" else set()
    signs = {"shift": "grid moved", "ends": "end frames", "decay": "twice", "fractions": "3 fractions"}
    for kind, words in signs.items():
        if kind != case.wrong and kind not in others and words in found and case.wrong != "source":
            faults.append(f"{kind}: found though it is right: {check['findings']}")
    if case.wrong is None and check["as_stored"]["rms_percent"] > 0.3:
        faults.append(f"a right dose: {check['as_stored']}, {check['findings']}")
    if case.wrong == "shift":
        off = np.linalg.norm(np.array(check["shift_mm"]) - case.shift)
        if off > 0.15 or check["shifted"]["rms_percent"] > 0.3:
            faults.append(f"shift {check['shift_mm']} for {case.shift}, {check['shifted']}")
    if case.wrong == "ends" and not set(case.seen_ends) <= set(check["wrong_frames"]) <= {0, 25}:
        faults.append(f"wrong frames {check['wrong_frames']}")


def decimals(data):
    """All decimal strings of a file, as they are written."""
    for element in data:
        if element.VR == "SQ":
            for item in element.value:
                yield from decimals(item)
        elif element.VR == "DS":
            values = element.value if isinstance(element.value, pydicom.multival.MultiValue) else [element.value]
            yield from (str(getattr(v, "original_string", v)) for v in values if v is not None)


def judge_round_trip(program, out, work, faults):
    """What is exported is read back as it was, here and by pydicom."""
    dicom, again = work / f"{out.name}_dicom", work / f"{out.name}_again"
    for command in (["export", "--dicom", dicom, "--config", out / "scene.toml"], ["import", dicom, "--out", again]):
        ended = subprocess.run([program, *command], capture_output=True, text=True)
        if ended.returncode != 0:
            faults.append(f"{command[0]}: {ended.stderr}")
            return
    long = [text for text in decimals(pydicom.dcmread(dicom / "rtplan.dcm")) if len(text.strip()) > 16]
    if long:
        faults.append(f"decimal strings of over 16 characters: {long[:3]}")
    if shutil.which("dciodvfy"):
        told = subprocess.run(["dciodvfy", dicom / "rtplan.dcm"], capture_output=True, text=True).stderr
        if "Error" in told:
            faults.append(f"dciodvfy: {told}")
    before, after = (tomllib.loads((folder / "plan.toml").read_text()) for folder in (out, again))
    for key in ("source", "source_strength_u", "prescription_gy"):
        if before[key] != after[key]:
            faults.append(f"{key}: {after[key]} comes back for {before[key]}")
    if len(before["catheter"]) != len(after["catheter"]):
        faults.append(f"{len(after['catheter'])} catheters come back")
        return
    for a, b in zip(before["catheter"], after["catheter"]):
        off = [np.abs(np.array(a[k]) - np.array(b[k])).max() if np.shape(a[k]) == np.shape(b[k]) else np.inf
               for k in ("course_mm", "dwell_mm", "dwell_s")]
        if a["name"] != b["name"] or max(off) > 1e-3:
            faults.append(f"{a['name']} comes back as {b['name']}, {off} off")


def run(program, sources, number, work):
    case = Case(sources, number)
    folder, out = work / f"in{number}", work / f"out{number}"
    folder.mkdir()
    case.write(folder, sources)
    faults = []
    source = [] if case.is_named else ["--source", case.source_name]
    imported = subprocess.run([program, "import", folder, "--out", out, *source], capture_output=True, text=True)
    checked = subprocess.run([program, "check-dose", folder, "--json", *source], capture_output=True, text=True)
    if case.malformed:
        words = imported.stderr + checked.stderr
        if checked.returncode != 2 or "300a" not in words or checked.stderr.count("\n") > 6:
            faults.append(f"exit {checked.returncode}: {words!r}")
        if case.malformed == "private" and "(300b,1040) of VENDOR HDR" not in checked.stderr:
            faults.append(f"the private data is not named: {checked.stderr!r}")
        if imported.returncode != 0 or (out / "plan.toml").exists():
            faults.append(f"the structures do not come in without the plan: {imported.returncode} {imported.stderr!r}")
    elif imported.returncode != 0 or checked.returncode != (0 if case.wrong is None else 3):
        faults.append(f"exit {imported.returncode} and {checked.returncode}: {imported.stderr}{checked.stderr}"
                      f"{checked.stdout[-800:]}")
    else:
        judge_import(case, out, faults)
        judge_check(case, json.loads(checked.stdout), faults)
        if number % 8 == 0:
            judge_round_trip(program, out, work, faults)
    what = f"{case.wrong or case.malformed or 'right'}, {case.weights} {case.running}, relative to {case.relative}, " \
           f"order {case.order}, structures {case.structures}, {case.source_name}{'' if case.is_named else ' unnamed'}"
    return [f"case {number} ({what}): {fault}" for fault in faults]


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    count, first = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((3, 24), (4, 0)))
    sources = {file.stem: Source(file) for file in folder.glob("*.toml")
               if file.stem in MODELS or file.stem == "varisource"}
    faults = []
    with tempfile.TemporaryDirectory() as work:
        for number in range(first, first + count):
            faults += run(program, sources, number, pathlib.Path(work))
    print("\n".join(faults))
    wrong = len({fault.split(" (")[0] for fault in faults})
    print(f"hdr_plans: {count - wrong} of {count} cases are right")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
