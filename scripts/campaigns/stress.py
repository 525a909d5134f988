#!/usr/bin/env python3
"""What scripts/campaigns/stress.sh plays, and what it makes of the outcome. Standard library only.

  stress.py trajectory SECONDS inspect.json surface.ply > trajectory.csv
  stress.py judge SECONDS daemon.json watch.json replay.json
    exit 0: every tick and frame certified or flagged, nothing
                                                                 not finite, no burst of missed deadlines; else 1
"""
import json
import math
import random
import sys

SPEED = 280.0  # mm/s: a needle's worst
JUMP_S = 1e-6  # a teleport's length: no pose is sent from the middle of it
OUTSIDE_MM = 55.0  # from a target inside the gland to outside of it
ASIDE_MM = 20.0  # beyond contact.max_displacement_mm
HEADER = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23"


def add(p, q, factor=1.0):
    return [a + factor * b for a, b in zip(p, q)]


def norm(v):
    return math.sqrt(sum(a * a for a in v))


def unit(v):
    return [a / norm(v) for a in v]


def cross(u, v):
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def across(axis):
    """A unit vector perpendicular to `axis`."""
    least = min(range(3), key=lambda k: abs(axis[k]))
    return unit(cross(axis, [float(k == least) for k in range(3)]))


class Needle:
    """A needle's way: tip and axis over time, mm and s."""

    def __init__(self):
        self.rows = []
        self.t = 0.0

    def sample(self, tip):
        self.tip = tip
        self.rows.append((self.t, self.axis, tip))

    def jump(self, tip, axis):
        self.t += JUMP_S
        self.axis = axis
        self.sample(tip)

    def move(self, tip, speed=SPEED):
        self.t += norm(add(tip, self.tip, -1)) / speed
        self.sample(tip)

    def hold(self, seconds):
        self.t += seconds
        self.sample(self.tip)

    def shake(self, direction, hz=10.0, amplitude=3.0, seconds=1.0, step=0.002):
        centre, begin = self.tip, self.t
        for k in range(1, round(seconds / step) + 1):
            self.t = begin + k * step
            self.sample(add(centre, direction, amplitude * math.sin(2 * math.pi * hz * k * step)))


class Stress:
    def __init__(self, inspected, surface, seed=1):
        self.random = random.Random(seed)
        self.anchors = inspected["anchors_mm"]
        self.surface = surface
        low, high = inspected["bbox_mm"]
        self.centre = [(a + b) / 2 for a, b in zip(low, high)]
        self.radii = [(b - a) / 2 for a, b in zip(low, high)]
        self.needle = Needle()

    def direction(self):
        return unit([self.random.gauss(0, 1) for _ in range(3)])

    def inside(self):
        return add(self.centre, [0.6 * r * u for r, u in zip(self.radii, self.direction())])

    def sweep(self):
        """In, to both sides as far as landmarks are clamped, out at the far side and back, all at full speed."""
        axis, target = self.direction(), self.inside()
        side, entry = across(axis), add(target, axis, -OUTSIDE_MM)
        self.needle.jump(entry, axis)
        for tip in (
            target,
            add(target, side, ASIDE_MM),
            add(target, side, -ASIDE_MM),
            target,
            add(target, axis, OUTSIDE_MM),
            entry,
        ):
            self.needle.move(tip)

    def teleport(self):
        """Six times into the middle of the gland, and a short push there."""
        for _ in range(6):
            tip, axis = self.inside(), self.direction()
            while norm(add(tip, self.needle.tip, -1)) < 15:  # beyond contact.max_jump_mm
                tip = self.inside()
            self.needle.jump(tip, axis)
            self.needle.move(add(tip, axis, 5))
            self.needle.hold(0.06)

    def shake(self):
        """At the capsule, along the needle and across it."""
        point = self.random.choice(self.surface)
        axis = unit(add(self.centre, point, -1))
        for direction, depth in ((axis, 0.0), (across(axis), 1.5)):
            self.needle.jump(add(point, axis, -20), axis)
            self.needle.move(add(point, axis, depth))
            self.needle.shake(direction)

    def anchor(self, number):
        """Through an anchor, back onto it; then started exactly on it, pushed and drawn aside from there."""
        anchor, axis = self.anchors[number % len(self.anchors)], self.direction()
        entry = add(anchor, axis, -OUTSIDE_MM)
        self.needle.jump(entry, axis)
        self.needle.move(add(anchor, axis, -5))
        self.needle.move(add(anchor, axis, 3), speed=20)
        self.needle.move(anchor, speed=20)
        self.needle.hold(0.15)
        self.needle.jump(entry, axis)
        self.needle.hold(0.02)
        self.needle.jump(anchor, axis)
        self.needle.hold(0.05)
        self.needle.move(add(anchor, axis, 1), speed=20)
        self.needle.move(add(self.needle.tip, across(axis), 5), speed=50)
        self.needle.move(anchor, speed=50)

    def rows(self, seconds):
        """Rounds of 4.9 s of all of these, cut at `seconds`; then out, so that the tissue comes to rest."""
        number = 0
        while self.needle.t < seconds:
            self.sweep()
            self.teleport()
            self.shake()
            if self.anchors:
                self.anchor(number)
            number += 1
        self.needle.rows = [row for row in self.needle.rows if row[0] < seconds]
        self.needle.t = seconds
        away = add(self.centre, [0, 0, 1], -100)
        self.needle.jump(away, [0.0, 0.0, 1.0])
        self.needle.hold(0.3)
        return self.needle.rows


def read_ply(path):
    """Vertices of the ASCII PLY that `brachy inspect --out` writes."""
    with open(path, encoding="ascii") as file:
        count = None
        for line in file:
            if line.startswith("element vertex "):
                count = int(line.split()[2])
            if line.strip() == "end_header":
                break
        return [[float(v) for v in next(file).split()[:3]] for _ in range(count)]


def write_trajectory(seconds, inspect_file, surface_file):
    with open(inspect_file, encoding="utf-8") as file:
        inspected = json.load(file)
    print(HEADER)
    for t, axis, tip in Stress(inspected, read_ply(surface_file)).rows(seconds):
        x = across(axis)
        y = cross(axis, x)
        matrix = [value for k in range(3) for value in (x[k], y[k], axis[k], tip[k])]
        print(",".join(repr(value) for value in [t] + matrix))


def judge(seconds, *files):
    daemon, watch, replay = [json.loads(open(f, encoding="utf-8").read().splitlines()[-1]) for f in files]
    failures = []

    def demand(what, holds):
        if not holds:
            failures.append(what)

    for counted, report, total in (("ticks", daemon, daemon["ticks"]), ("frames", watch, watch["snapshots"])):
        verdicts = {v: report[f"{counted}_{v}"] for v in ("injective", "folded", "unknown")}
        guards = {g: report[f"{counted}_{g}"] for g in ("substepped", "clamped", "merged", "dropped", "solve_failed")}
        print(
            f"  {counted}: {total}: "
            + ", ".join(f"{n} {name}" for name, n in verdicts.items())
            + "; "
            + ", ".join(f"{n} {name}" for name, n in guards.items())
        )
        print(
            f"    least det: bound {report['min_det_bound']}, at vertices {report['min_vertex_det']}; at most "
            f"{report['max_substeps']} sub-steps, {report['max_held_mm']:.2f} mm clamped, condition "
            f"{report['max_condition']:.3g}"
        )
        demand(f"{counted} without a verdict", sum(verdicts.values()) == total)
        demand(f"{counted} that are neither injective nor flagged", report[f"{counted}_unflagged"] == 0)
        demand(f"{counted} with coordinates that are not finite", report["nonfinite"] == 0)

    missed, own = daemon["overruns"], daemon["control_overruns"]
    burst, own_burst = daemon["longest_overrun"], daemon["control_longest_overrun"]
    print(
        f"  deadlines: {missed} missed, at most {burst} in a row; "
        f"an idle thread's: {own}, at most {own_burst} in a row; "
        f"tick p99 {daemon['tick_ms']['p99']:.2f} ms, max {daemon['tick_ms']['max']:.2f} ms"
    )
    demand("more deadlines missed than the machine's own", missed <= own + 5)
    demand("a burst of missed deadlines", burst < 3 or burst <= own_burst)

    print(
        f"  needle: {replay['poses_accepted']} poses accepted, {replay['poses_refused']} refused; "
        f"deepest {replay['max_depth_mm']:.1f} mm, largest displacement {daemon['max_disp_mm']:.1f} mm"
    )
    demand("too few poses came through for a stress test", replay["poses_accepted"] >= 0.9 * 200 * seconds)
    demand("the needle was not in the gland", replay["max_depth_mm"] > 20 and daemon["max_disp_mm"] > 1)
    for failure in failures:
        print(f"stress: FAILED: {failure}")
    if not failures:
        print(
            "stress: ok: every tick and frame is certified or flagged, everything is finite, "
            "no burst of missed deadlines"
        )
    return 1 if failures else 0


if __name__ == "__main__":
    command, seconds = sys.argv[1], float(sys.argv[2])
    if command == "trajectory":
        write_trajectory(seconds, *sys.argv[3:])
    else:
        sys.exit(judge(seconds, *sys.argv[3:]))
