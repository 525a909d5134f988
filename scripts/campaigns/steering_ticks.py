#!/usr/bin/env python3
"""Ticks a second of the steering environment on two processes against one loop in C++ over the same poses.

On psi31, and on elastic with a needle that bends, 14,560 points. Rounds of each in turn; the ratio is that of the best
rounds. Where other programs use the cores the clock says nothing: so also by processor time, all processes of Python's
side counted, those that wait not: two cores would then make 2 × C++'s time a tick over Python's.

usage: scripts/campaigns/steering_ticks.py [--build DIR] [--environments N] [--steps N] [--rounds N]
"""
import argparse
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
REQUIRED = 1.6
NEEDLE = '[needle]\nflexible = true\ngauge = 20\nbevel_force_share = 0.3\nguide_at = "template"\n'
SCENES = {"psi31": '[model]\nkernel = "psi31"\n', "elastic, bending": '[model]\nkernel = "elastic"\n' + NEEDLE}
HOLES = ((10, 0), (-10, 0))


def actions(steps, n):
    """Pushing, and turning to and fro, each environment at another rate: t×n×2."""
    import numpy as np
    turn = np.sin(np.arange(steps)[:, None] * (0.02 + 0.005 * np.arange(n)))
    return np.stack([np.ones((steps, n)), turn], axis=2)


def poses_of(settings, like, wanted, seed):
    """What each environment of a vector does with these actions, one after the other: t×3×4, NaN at each reset."""
    import numpy as np
    from brachyd.steering import NeedleSteering
    found = []
    for i in range(wanted.shape[1]):
        environment = NeedleSteering(settings, reach=like.reach)
        environment.reset(seed=seed + i)
        found += [np.full((3, 4), np.nan), environment.pose.copy()]
        is_over = False
        for action in wanted[:, i]:
            if is_over:
                environment.reset()
                found.append(np.full((3, 4), np.nan))
                is_over = False
            else:
                _, terminated, truncated = environment.advance(*action.tolist())
                is_over = terminated or truncated
            found.append(environment.pose.copy())
    return np.array(found)


def processor_s():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def python_round(environment, wanted, seed):
    """Ticks a second, and processor time a tick of all processes, s."""
    environment.reset(seed=seed)
    ticks = wanted.shape[0] * wanted.shape[1]
    used, begin = processor_s() + environment.processor_s(), time.perf_counter()
    for action in wanted:
        environment.step(action)
    seconds = time.perf_counter() - begin
    return ticks / seconds, (processor_s() + environment.processor_s() - used) / ticks


def cpp_round(loop, scene, poses):
    said = subprocess.run([loop, scene, poses], check=True, capture_output=True, text=True).stdout
    rate, used = re.match(r"([\d.e+]+) ticks/s, ([\d.e+]+) us", said).groups()
    return float(rate), 1e-6 * float(used)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--environments", type=int, default=8)
    parser.add_argument("--steps", type=int, default=800, help="of each environment and round")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    build = (ROOT / options.build).resolve()
    sys.path[:0] = [str(ROOT / "apps/python"), str(build / "python")]
    from brachyd.steering import SteeringSettings
    from brachyd.vector import VectorNeedleSteering
    wanted = actions(options.steps, options.environments)
    is_reached = True
    for name, text in SCENES.items():
        settings = SteeringSettings(text=text, holes_mm=HOLES)
        with tempfile.TemporaryDirectory() as folder, \
                VectorNeedleSteering(options.environments, settings, processes=2, copy=False) as environment:
            scene, poses = pathlib.Path(folder, "scene.toml"), pathlib.Path(folder, "poses")
            scene.write_text(text, encoding="ascii")
            poses_of(settings, environment, wanted, seed=1).tofile(poses)
            rounds = [(cpp_round(build / "bin/engine_loop", scene, poses), python_round(environment, wanted, 1))
                      for _ in range(options.rounds)]
        cpp, python = max(r[0][0] for r in rounds), max(r[1][0] for r in rounds)
        cpp_s, python_s = min(r[0][1] for r in rounds), min(r[1][1] for r in rounds)
        ratio = python / cpp
        is_reached &= ratio >= REQUIRED
        print(f"{name}: {options.environments} environments on 2 processes {python:.0f} ticks/s, C++ {cpp:.0f}: ratio "
              f"{ratio:.2f}, at least {REQUIRED} is asked for; processor time a tick {1e6 * python_s:.0f} and "
              f"{1e6 * cpp_s:.0f} us, by which 2 cores make {2 * cpp_s / python_s:.2f}; load {os.getloadavg()[0]:.1f}",
              flush=True)
    return 0 if is_reached else 1


if __name__ == "__main__":
    sys.exit(main())
