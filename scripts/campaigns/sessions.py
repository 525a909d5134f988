#!/usr/bin/env python3
"""Sessions of the plan of config/session.toml, each with one deliberate mistake: writes their needles' motion, plays
each offline, and checks that the score's first three findings name the mistake, and that the perfect session has none.
Standard library only. DIRECTORY must not hold earlier sessions.

  sessions.py BRACHY DIRECTORY [NAME ...]     NAME: only these sessions
"""
import json
import os
import random
import subprocess
import sys
import tomllib

CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../config")
ORIGIN, SPACING = (-30.0, -30.0, -60.0), 5.0  # the default template, hole A1
SEED_MM, SPACER_MM = 4.5, 5.5
OUTSIDE_MM, IN_MM_S, OUT_MM_S = 5.0, 50.0, 20.0
URETHRA = (0.0, 0.0)          # the phantom's, x and y, within the gland
RECTUM = (0.0, -30.0)         # its axis


def hole(name):
    return ORIGIN[0] + SPACING * (ord(name[0]) - ord("A")), ORIGIN[1] + SPACING * (int(name[1:]) - 1)


def train_mm(train):
    return sum(SEED_MM if c == "s" else SPACER_MM for c in train)


class Device:
    """Keyframes of a needle along +z."""

    def __init__(self, speed=1.0):
        self.rows, self.speed = [], speed

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

    def write(self, file):
        with open(file, "w") as out:
            out.write("t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,button\n")
            for t, x, y, z, button in self.rows:
                out.write(f"{t:.6f},1,0,0,{x!r},0,1,0,{y!r},0,0,1,{z!r},{button}\n")


def needles(plan):
    return [(*hole(n["hole"]), ORIGIN[2] + plan["base_plane_mm"] - n.get("retraction_mm", 0), n["train"])
            for n in plan["needle"]]


def session(name, plan):
    """The device, its part of the scene, and what one of the first three findings says; None: there is none."""
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
    if name == "urethra":
        for _ in range(3):
            device.puncture(*URETHRA, 0.0)
    if name == "rectum":
        for _ in range(3):
            device.puncture(*RECTUM, 0.0)
    if name == "without_seeds":
        free = [h for h in ("F4", "H4", "F10", "H10", "D6", "J6", "E9", "I9", "F5", "H5", "D8", "J8") if h not in names]
        for h in free[:6]:
            device.puncture(*hole(h), 0.0)
    # An assistant's order knows no hole that was skipped: the others are loaded for theirs.
    loading = "order" if name in ("wrong_hole", "swapped") else "hole"
    return device, loading, {
        "perfect": None, "shallow": "too shallow", "deep": "too deep", "one_skipped": "left no seed in place",
        "side_skipped": "4 needles left no seed in place", "wrong_hole": f"needle {names[middle]} went through",
        "swapped": "were swapped", "half_released": f"needle {names[middle]}:",
        "needle_twice": "entered again through the same hole", "urethra": "the urethra was entered 3 times",
        "rectum": "the rectum was entered 3 times", "without_seeds": "6 punctures without a seed",
        "five_times_too_fast": "too fast", "clinical_noise": "depths scatter", "sideways": "to one side"}[name]


# The phantom has no bladder, so that there are fifteen here.
SESSIONS = ("perfect", "shallow", "deep", "one_skipped", "side_skipped", "wrong_hole", "swapped", "half_released",
            "needle_twice", "urethra", "rectum", "without_seeds", "five_times_too_fast", "clinical_noise", "sideways")


def main():
    brachy, folder, *only = sys.argv[1:]
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(CONFIG, "plan.toml"), "rb") as file:
        plan = tomllib.load(file)
    failed = 0
    for name in only or SESSIONS:
        device, loading, expected = session(name, plan)
        motion, scene, out = (os.path.join(folder, name + end) for end in (".csv", ".toml", ""))
        device.write(motion)
        with open(scene, "w") as file:
            file.write(f'[plan]\nfile = "{os.path.abspath(os.path.join(CONFIG, "plan.toml"))}"\n'
                       f'[seeds]\napplicator = "train"\nloading = "{loading}"\n')
        subprocess.run([brachy, "replay", motion, "--offline", "--config", scene, "--session", out], check=True,
                       stdout=subprocess.DEVNULL)
        with open(os.path.join(out, "report.json")) as file:
            report = json.load(file)
        said = [finding["text"] for finding in report["findings"]]
        good = not said if expected is None else any(expected in text for text in said[:3])
        failed += not good
        print(f'{name:20} {"ok  " if good else "FAIL"} {report["seeds"]["headline"]}')
        for text in said[:3]:
            print(f"    {text}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
