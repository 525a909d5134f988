#!/usr/bin/env python3
"""What scripts/campaigns/hostile_poses.sh plays, and what it makes of the outcome. Standard library only.

  hostile_poses.py scene NEEDLES > scene.toml
  hostile_poses.py trajectory NEEDLES SEED > trajectory.csv
  hostile_poses.py judge NEEDLES daemon.json
  hostile_poses.py offline SCRIPTS path/to/brachy      all scripts by the simulator alone, one a core: no time is judged
"""
import concurrent.futures
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

SECONDS = 10.0
RATE_HZ = 200
PITCH_MM = 8.0
PERIOD_MS = 5.0
HEADER = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,needle"


def scene_of(needles):
    return f'name = "hostile poses"\n[needle]\ncount = {needles}\n'


def rotation(tilt, turn, roll):
    """Rows of a rotation: the shaft tilted by `tilt` towards `turn`, and turned about itself by `roll`, radians."""
    ct, st, cu, su = math.cos(tilt), math.sin(tilt), math.cos(turn), math.sin(turn)
    tilted = [
        [ct * cu * cu + su * su, (ct - 1) * cu * su, st * cu],
        [(ct - 1) * cu * su, ct * su * su + cu * cu, st * su],
        [-st * cu, -st * su, ct],
    ]
    cr, sr = math.cos(roll), math.sin(roll)
    return [[row[0] * cr + row[1] * sr, row[1] * cr - row[0] * sr, row[2]] for row in tilted]


class Hand:
    """One needle's way: in within a second, then what its script does to it."""

    def __init__(self, needle, needles, rng):
        side = math.ceil(math.sqrt(needles))
        self.home = [PITCH_MM * (k - (side - 1) / 2) for k in (needle % side, needle // side)]
        self.rng = rng
        self.kind = rng.choice(["stir", "twist", "teleport"])
        self.radius = rng.uniform(2, 8)
        self.rate = rng.uniform(1, 8)
        self.phase = rng.uniform(0, 2 * math.pi)
        self.depth = rng.uniform(0, 18)
        self.tilt = rng.uniform(0, 0.3)
        self.place = [0.0, 0.0, 0.0]

    def pose(self, t):
        x, y = self.home
        depth = -45 + (45 + self.depth) * min(1, t)
        grown = min(1, max(0, t - 1))
        angle = 2 * math.pi * self.rate * t + self.phase
        tilt = roll = 0.0
        if self.kind == "stir":
            x += grown * self.radius * math.cos(angle)
            y += grown * self.radius * math.sin(angle)
            depth += 0.3 * grown * self.radius * math.sin(1.7 * angle)
        elif self.kind == "twist":
            tilt, roll = grown * self.tilt * math.sin(angle), 3 * angle
        elif t > 1:
            if self.rng.random() < 2 / RATE_HZ:
                self.place = [self.rng.uniform(-20, 20) for _ in range(3)]
            x, y, depth = x + self.place[0], y + self.place[1], depth + self.place[2]
        rows = rotation(tilt, angle, roll)
        return [v for row, p in zip(rows, (x, y, depth)) for v in row + [p]]


def write_trajectory(needles, seed, file=sys.stdout):
    rng = random.Random(1000 * needles + seed)
    hands = [Hand(k, needles, rng) for k in range(needles)]
    print(HEADER, file=file)
    for i in range(int(SECONDS * RATE_HZ)):
        for k, hand in enumerate(hands):
            t = i / RATE_HZ
            print(",".join(f"{v:.6g}" for v in [t] + hand.pose(t)) + f",{k}", file=file)


def judge(needles, file):
    daemon = json.loads(open(file, encoding="utf-8").read().splitlines()[-1])
    ticks, tick = daemon["ticks"], daemon["tick_ms"]
    missed = 100 * daemon["overruns"] / ticks
    own = 100 * daemon["control_overruns"] / daemon["control_ticks"]
    print(
        f"hostile poses: {needles} needles: {ticks} ticks, ms p50 {tick['p50']:.2f}, p99 {tick['p99']:.2f}, max "
        f"{tick['max']:.2f}; missed {missed:.2f} %, idle thread {own:.2f} %; {daemon['ticks_unknown']} unknown, "
        f"{daemon['ticks_folded']} folded, {daemon['ticks_clamped']} clamped, {daemon['ticks_unflagged']} not flagged, "
        f"{daemon['nonfinite']} not finite"
    )
    failures = []
    if daemon["ticks_unflagged"] or daemon["nonfinite"]:
        failures.append("ticks neither certified nor flagged, or not finite")
    if tick["p99"] > 0.8 * PERIOD_MS:
        failures.append(f"p99 above {0.8 * PERIOD_MS:.1f} ms")
    if missed > own + 0.5:
        failures.append("deadlines missed")
    for failure in failures:
        print(f"  FAILED: {failure}")
    return 1 if failures else 0


def replay(brachy, folder, needles, seed):
    """What `brachy replay --offline` says of one script."""
    scene, trajectory = (pathlib.Path(folder) / f"{needles}_{seed}.{end}" for end in ("toml", "csv"))
    scene.write_text(scene_of(needles), encoding="utf-8")
    with open(trajectory, "w", encoding="utf-8") as file:
        write_trajectory(needles, seed, file)
    command = [brachy, "replay", trajectory, "--offline", "--config", scene, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    trajectory.unlink()
    return json.loads(done.stdout)


def judge_offline(needles, outcomes):
    """A row of sums, and whether every tick is finite and certified or flagged."""
    counts = [key for key in outcomes[0] if key.startswith("ticks") or key == "nonfinite"]
    total = {key: sum(outcome[key] for outcome in outcomes) for key in counts}
    peaks = [f"peak_{way}_n" for way in ("out", "in", "lateral")]
    forces = [needle[peak] for outcome in outcomes for needle in outcome["needles"] for peak in peaks]
    print(
        f"hostile poses, simulator alone: {needles} needles: {len(outcomes)} scripts, {total['ticks']} ticks, "
        f"{total['ticks_in_contact']} in contact; {total['ticks_injective']} injective, "
        f"{total['ticks_unknown']} unknown, {total['ticks_folded']} folded, {total['ticks_clamped']} clamped, "
        f"{total['ticks_unflagged']} not flagged, {total['nonfinite']} not finite; largest force {max(forces):.1f} N",
        flush=True,
    )
    return total["ticks_unflagged"] == 0 and total["nonfinite"] == 0 and all(map(math.isfinite, forces))


def play_offline(scripts, brachy):
    good = True
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for needles in (1, 4, 16):
            seeds = range((scripts + 2) // 3)
            outcomes = list(pool.map(lambda seed, n=needles: replay(brachy, folder, n, seed), seeds))
            good &= judge_offline(needles, outcomes)
    return 0 if good else 1


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "scene":
        print(scene_of(int(sys.argv[2])), end="")
    elif len(sys.argv) == 4 and sys.argv[1] == "trajectory":
        write_trajectory(int(sys.argv[2]), int(sys.argv[3]))
    elif len(sys.argv) == 4 and sys.argv[1] == "judge":
        sys.exit(judge(int(sys.argv[2]), sys.argv[3]))
    elif len(sys.argv) == 4 and sys.argv[1] == "offline":
        sys.exit(play_offline(int(sys.argv[2]), sys.argv[3]))
    else:
        sys.exit(__doc__)
