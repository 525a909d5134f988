"""Draws a pelvis in the files of a clinic, and cases of shapes beyond anatomy: for import_cases.py."""
import unicodedata

import numpy as np
import pydicom

import case_files as files
import case_shapes as shapes_of
import hdr_plans
import make_odd_cases as odd

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
              ("Cabeza femoral izq", "Cabeza femoral der"), ("FemurHead_L", "FemurHead_R"),
              ("Heupkop li", "Heupkop re")]
TARGETS = ["PTV_Prostate", "PTV", "Ring prostate-PTV", "CTV", "Prostate+5mm", "prostate_expansion", "Rectum_PRV",
           "Urethra_PRV05", "zRectum", "100% isodose", "Rectum-PTV", "Prostatabett", "Avoid_Bladder", "PTV 145Gy",
           "CTV_Prostate", "Prostate PTV", "Dose 150[%]", "Bladder-Rectum", "Helper Prostate"]
TOTAL_SEGMENTATOR = {"prostate": "prostate", "urethra": "urethra", "rectum": "rectum", "bladder": "urinary_bladder",
                     "left": "hip_left", "right": "hip_right", "penile_bulb": "penile_bulb",
                     "seminal_vesicles": "seminal_vesicles"}
WARNED = ("mirrored", "turned over", "in cm", "sides exchanged")
CHARSETS = ["ISO_IR 100", "ISO_IR 101", "ISO_IR 144", "ISO_IR 126", "ISO_IR 192", "ISO_IR 148", "GB18030"]


WRITERS = [(files.write_nifti, ".nii.gz"), (files.write_nrrd, ".nrrd"), (files.write_mha, ".mha")]


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


def patient(case):
    rng = case.rng
    form = case.pick("rtstruct", "rtstruct", "rtstruct", "segmentation", "table", "folder", "one label", "dicom seg")
    case.warned = WARNED[rng.integers(4)] if case.chance(0.12) else None
    is_dicom = form in ("rtstruct", "dicom seg")
    plan = case.pick(None, None, "ldr", "post", "hdr") if is_dicom and not case.warned else None
    is_turned = form == "rtstruct" and not case.warned
    frame = case.pick("axial", "axial", "flipped", "tilted", "any") if is_turned else "axial"
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


def draw_series_beside(case, shapes):
    R = shapes_of.slice_frame(case.rng, "axial")
    boxes = np.array([s.box() for s in shapes.values()])
    low, high = boxes[:, 0].min(0), boxes[:, 1].max(0)
    corners = np.array(np.meshgrid(*zip(low, high), indexing="ij")).reshape(3, -1).T @ R
    heights = np.arange(low[2] - 9, high[2] + 9, 2.5)
    case.image, _ = files.image_series(case.folder / "images", case.rng, R, (corners.min(0), corners.max(0)), heights,
                                       case.oddity, "plain")
    case.is_image_taken = True


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
        name = case.pick("Segmentation.seg.nrrd", "S.SEG.NRRD", "seg.nrrd")
        files.write_nrrd(folder / name, moved, written, dtype, rng, keys)
    elif form == "table":
        files.write_nifti(folder / case.pick("seg.nii.gz", "labels.nii", "SEG.NII.GZ"), moved, labels, dtype, rng,
                          {values[k]: names[k] for k in shapes})
    elif form == "dicom seg":
        kind = case.pick("BINARY", "BINARY", "FRACTIONAL", "LABELMAP")
        masks = {k: labels == values[k] for k in shapes}
        if kind != "LABELMAP" and case.chance(0.5):
            # The gland with the urethra in it: segments may overlap.
            masks["prostate"] = shapes["prostate"].holds(points)
            truth = grid.truth(masks["prostate"])
            share = 1e-3 if case.warned == "in cm" else 1
            case.structures[names["prostate"]] |= {"cc": share * truth["cc"], "middle": transform(truth["middle"])}
        files.segmentation(folder / "SEG.dcm", moved, list(masks.values()), [names[k] for k in masks], kind,
                           case.oddity if case.oddity != "big endian" else "plain")
        if not case.warned and case.chance(0.4):
            draw_series_beside(case, shapes)
    elif form == "folder":
        if case.warned == "sides exchanged":
            by_file["hip_left"], by_file["hip_right"] = by_file["hip_right"], by_file["hip_left"]
        case.structures = by_file
        other = {"left": "right", "right": "left"} if case.warned == "sides exchanged" else {}
        many = case.chance(0.5)
        for kind in shapes:
            write, ending = WRITERS[rng.integers(3)] if many else WRITERS[0]
            file = TOTAL_SEGMENTATOR[other.get(kind, kind)]
            write(folder / (file + ending), moved, labels == values[kind], dtype, rng)
        files.write_nifti(folder / "spleen.nii.gz", moved, labels * 0, "u1", rng)
    else:
        gland = case.structures[names["prostate"]]
        case.structures = {"": gland}
        case.warned = "in cm" if case.warned == "in cm" else None
        write, ending = WRITERS[rng.integers(3)]
        write(folder / ("label" + ending.replace(".nii.gz", ".NII")), moved, labels == values["prostate"], dtype, rng)
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
    plan = odd.implant([(s, at * files.LPS, None if axis is None else axis * files.LPS) for s, at, axis in seeds],
                       sources)
    axes = [(0, 0, 1) if axis is None else axis / np.linalg.norm(axis) for _, _, axis in seeds]
    case.seeds = np.array([[*at, *axis, number, sources[s - 1][1]] for (s, at, _), axis in zip(seeds, axes)])
    files.save(plan, case.folder / "RP.dcm", case.oddity)
    return plan


UNUSED = ("second plan", "external", "localizer", "capture", "registration", "report", "presentation", "text",
          "picture", "empty", "second dose", "dose elsewhere", "relative dose", "parametric map", "hidden", "pdf",
          "dicomdir",
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


# Shapes beyond anatomy.

def outlines(case):
    """A dozen structures, each in slices of its own frame and distance."""
    rng = case.rng
    case.is_anatomy = False
    structures = []
    for n in range(12):
        spacing = float(rng.choice([0.5, 1, 1.25, 2, 2.5, 3, 5]))
        shape = shapes_of.Outlines(rng, spacing)
        R = shapes_of.slice_frame(rng, ["axial", "flipped", "any", "any"][rng.integers(4)])
        shift = rng.uniform(-150, 150, 3)
        ways = {"jitter": float(rng.choice([0, 0, 0.011, 0.03, 0.1 * spacing])), "twice": case.chance(0.3),
                "keyhole": case.chance(0.4)}
        contours, truth = shapes_of.drawn(rng, shape, R, [h for h, _ in shape.sections], ways)
        digits = int(rng.choice([2, 3, 4, 6]))
        name = f"shape {n}"
        case.structures[name] = {"role": "other" if n else "prostate", **truth, "middle": truth["middle"] + shift,
                                 "what": f"{shape.kind} {spacing} {ways} {digits}"}
        structures.append((n + 1, name, [files.contour(c + shift, "CLOSED_PLANAR", digits) for c in contours]))
    case.options += ["--gland", "shape 0"]
    files.save(files.structure_set(structures, None), case.folder / "RS.dcm")
