"""The sixteen sessions: what each hand does with the plan of config/plan.toml, and what must come of it: where the
seeds fall, which organs are entered and how deep, and what the score must say. From geometry alone: nothing here comes
from the program. Lengths mm, world frame W. Standard library only."""
import math
import os
import random
import struct
import tomllib

CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../config")
ORIGIN, SPACING = (-30.0, -30.0, -60.0), 5.0  # the default template, hole A1
SEED_MM, SPACER_MM = 4.5, 5.5
OUTSIDE_MM, IN_MM_S, OUT_MM_S = 5.0, 50.0, 20.0
URETHRA = (0.0, 0.0)    # x and y of a puncture through it, to z = 0
RECTUM = (0.0, -30.0)   # the same
ORGAN_TIP_Z = 0.0
SPHERE_CENTRE, SPHERE_RADIUS, SPHERE_TIP_Z = (0.0, 4.0, 42.0), 18.0, 34.0  # a bladder above the base

# The phantom has no bladder: that session's scene brings one.
SESSIONS = ("perfect", "shallow", "deep", "one_skipped", "side_skipped", "wrong_hole", "swapped", "half_released",
            "needle_twice", "urethra", "rectum", "bladder", "without_seeds", "five_times_too_fast", "clinical_noise",
            "sideways")


def load_plan():
    with open(os.path.join(CONFIG, "plan.toml"), "rb") as file:
        return tomllib.load(file)


def hole(name):
    return ORIGIN[0] + SPACING * (ord(name[0]) - ord("A")), ORIGIN[1] + SPACING * (int(name[1:]) - 1)


def train_mm(train):
    return sum(SEED_MM if c == "s" else SPACER_MM for c in train)


def offsets_mm(train):
    """Of the seeds' centres behind the tip."""
    at, offsets = 0.0, []
    for c in train:
        if c == "s":
            offsets.append(at + SEED_MM / 2)
        at += SEED_MM if c == "s" else SPACER_MM
    return offsets


class Device:
    """Keyframes of a needle along +z, and the seeds that fall: where a seed's centre is at the tip."""

    def __init__(self, speed=1.0):
        self.rows, self.speed, self.seeds = [], speed, []

    def go(self, x, y, z, mm_s=IN_MM_S, button=0):
        t = 0.0
        if self.rows:
            t0, x0, y0, z0, _ = self.rows[-1]
            way = ((x - x0) ** 2 + (y - y0) ** 2 + (z - z0) ** 2) ** 0.5
            self.rows[-1][4] = button
            t = t0 + max(way / mm_s, 0.1) / self.speed
        self.rows.append([t, x, y, z, button])

    def puncture(self, x, y, z):
        self.go(x, y, ORIGIN[2] - OUTSIDE_MM)
        self.go(x, y, z)
        self.go(x, y, ORIGIN[2] - OUTSIDE_MM)

    def implant(self, x, y, tip, train, share=1.0):
        """Leaves the first `share` of the train."""
        start = ORIGIN[2] - OUTSIDE_MM
        self.go(x, y, start)
        self.go(x, y, tip)
        self.go(x, y, tip)
        self.go(x, y, tip, button=1)
        self.go(x, y, tip - share * train_mm(train), OUT_MM_S, 1)
        self.go(x, y, tip - share * train_mm(train))
        self.go(x, y, start)
        self.seeds += [(x, y, tip - o) for o in offsets_mm(train) if o <= share * train_mm(train)]

    def write(self, file):
        with open(file, "w") as out:
            out.write("t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,button\n")
            for t, x, y, z, button in self.rows:
                out.write(f"{t:.6f},1,0,0,{x!r},0,1,0,{y!r},0,0,1,{z!r},{button}\n")


def needles(plan):
    return [(*hole(n["hole"]), ORIGIN[2] + plan["base_plane_mm"] - n.get("retraction_mm", 0), n["train"])
            for n in plan["needle"]]


def planned_seeds(plan):
    return [(x, y, tip - o) for x, y, tip, train in needles(plan) for o in offsets_mm(train)]


# Depths: the largest distance of the tip from the organ's surface, inside it, by the formulas of the phantom
# (core/brachytherapy/structures/phantom_structures.h).
def urethra_depth_mm(x, y, z):
    """Of the tube of 3 mm radius about y = −4 + 0.0095 (z + 3)², −25.5 ≤ z ≤ 24.5."""
    near = [z + 0.02 * k for k in range(-300, 301) if -25.5 <= z + 0.02 * k <= 24.5]
    if not near:
        return 0.0
    away = min(math.dist((x, y, z), (0, -4 + 0.0095 * (s + 3) ** 2, s)) for s in near)
    return min(3 - away, z + 25.5, 24.5 - z)


def depth_along(depth_of, x, y, z_tip):
    return max(depth_of(x, y, z_tip - 0.05 * k) for k in range(1400))


def rectum_depth_mm(x, y, z):
    return min(13.5 - math.dist((x, y), (0, -36.5)), z + 37.5, 37.5 - z)


def bladder_depth_mm(x, y, z):
    return SPHERE_RADIUS - math.dist((x, y, z), SPHERE_CENTRE)


def bladder_hole(plan):
    taken = {(a[0], a[1]) for a in needles(plan)}
    return next(h for h in ((10.0, 5.0), (-10.0, 5.0), (10.0, 0.0), (-10.0, 0.0), (5.0, 10.0), (-5.0, 10.0))
                if h not in taken)


def write_sphere(file, centre, radius, rings=24, sides=48):
    """A closed binary STL."""
    def point(i, k):
        a, b = math.pi * i / rings, 2 * math.pi * (k % sides) / sides
        return (centre[0] + radius * math.sin(a) * math.cos(b), centre[1] + radius * math.sin(a) * math.sin(b),
                centre[2] + radius * math.cos(a))
    triangles = []
    for i in range(rings):
        for k in range(sides):
            a, b, c, d = point(i, k), point(i + 1, k), point(i + 1, k + 1), point(i, k + 1)
            if i + 1 < rings:
                triangles.append((a, b, c))
            if i > 0:
                triangles.append((a, c, d))
    with open(file, "wb") as out:
        out.write(b"\0" * 80 + struct.pack("<I", len(triangles)))
        for t in triangles:
            out.write(struct.pack("<12fH", 0, 0, 0, *(v for p in t for v in p), 0))


class Session:
    """One of SESSIONS: `device`; `loading` of the scene; `says`, what one of the first three findings contains, None:
    there are no findings; `organ`, (name, passes, depth in mm) or None: no organ is entered."""

    def __init__(self, name, plan):
        all_of = needles(plan)
        names = [n["hole"] for n in plan["needle"]]
        device = Device(5.0 if name == "five_times_too_fast" else 1.0)
        offset = {"shallow": (0, 0, -5), "deep": (0, 0, 5), "sideways": (2, 0, 0)}.get(name, (0, 0, 0))
        middle = len(all_of) // 2
        side = sorted(range(len(all_of)), key=lambda n: all_of[n][0])[:4]
        order = list(range(len(all_of)))
        if name == "swapped":
            order[2], order[-2] = order[-2], order[2]
        rng = random.Random(7)
        for n, at in enumerate(order):
            x, y, tip, _ = all_of[at]
            train = all_of[n][3]  # needles are handed out in the plan's order
            if (name == "one_skipped" and n == middle) or (name == "side_skipped" and n in side):
                continue
            if name == "wrong_hole" and n == middle:
                x = next(x + d for d in (SPACING, -SPACING) if (x + d, y) not in {(a[0], a[1]) for a in all_of})
            if name == "clinical_noise":
                x, y, tip = x + rng.gauss(0, 1.3), y + rng.gauss(0, 1.3), tip + rng.gauss(0, 4.7)
            half = name == "half_released" and n == middle
            device.implant(x + offset[0], y + offset[1], tip + offset[2], train, 0.5 if half else 1.0)
            if name == "needle_twice" and n == middle:
                device.puncture(x, y, tip)
        self.organ = None
        if name == "urethra":
            for _ in range(3):
                device.puncture(*URETHRA, ORGAN_TIP_Z)
            self.organ = (name, 3, depth_along(urethra_depth_mm, *URETHRA, ORGAN_TIP_Z))
        if name == "rectum":
            for _ in range(3):
                device.puncture(*RECTUM, ORGAN_TIP_Z)
            self.organ = (name, 3, depth_along(rectum_depth_mm, *RECTUM, ORGAN_TIP_Z))
        if name == "bladder":
            at = bladder_hole(plan)
            device.puncture(*at, SPHERE_TIP_Z)
            self.organ = (name, 1, depth_along(bladder_depth_mm, *at, SPHERE_TIP_Z))
        if name == "without_seeds":
            free = [h for h in ("F4", "H4", "F10", "H10", "D6", "J6", "E9", "I9", "F5", "H5", "D8", "J8")
                    if h not in names]
            for h in free[:6]:
                device.puncture(*hole(h), 0.0)
        self.name, self.device = name, device
        # An assistant's order knows no hole that was skipped: the others are loaded for theirs.
        self.loading = "order" if name in ("wrong_hole", "swapped") else "hole"
        self.says = {
            "perfect": None, "shallow": "too shallow", "deep": "too deep", "one_skipped": "left no seed in place",
            "side_skipped": "4 needles left no seed in place", "wrong_hole": f"needle {names[middle]} went through",
            "swapped": "were swapped", "half_released": f"needle {names[middle]}:",
            "needle_twice": "entered again through the same hole", "urethra": "the urethra was entered 3 times",
            "rectum": "the rectum was entered 3 times", "bladder": "the bladder was entered 1 time",
            "without_seeds": "6 punctures without a seed", "five_times_too_fast": "too fast",
            "clinical_noise": "depths scatter", "sideways": "to one side"}[name]

    def write(self, folder, model_text=""):
        """Motion and scene; returns their paths."""
        motion, scene = (os.path.join(folder, self.name + end) for end in (".csv", ".toml"))
        self.device.write(motion)
        with open(scene, "w") as file:
            file.write(f'[plan]\nfile = "{os.path.abspath(os.path.join(CONFIG, "plan.toml"))}"\n'
                       f'[seeds]\napplicator = "train"\nloading = "{self.loading}"\n{model_text}')
            if self.name == "bladder":
                write_sphere(os.path.join(folder, "bladder.stl"), SPHERE_CENTRE, SPHERE_RADIUS)
                file.write('[[structure]]\nname = "bladder"\nfile = "bladder.stl"\n')
        return motion, scene
