#!/usr/bin/env python3
"""Ticks a second of the steering environment on two processes against one loop in C++ over the same poses.

Two ways: actors, each a process that steps its own environment, and a vector, whose processes wait for each other at
every step and whose environments share a core's cache. On psi31, and on elastic with a needle that bends, 14,560
points. Rounds of each in turn, each between two of C++'s; a ratio is the median of the rounds. 1.6 is asked of the
actors. Where other programs use the cores the clock says nothing: so also by processor time, all processes of Python's
side counted, those that wait not: two cores would then make 2 × C++'s time a tick over Python's.

usage: scripts/campaigns/steering_ticks.py [--build DIR] [--environments N] [--steps N] [--rounds N]
"""
import argparse
import os
import pathlib
import re
import resource
import statistics
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


class Actor:
    """A process with an environment of its own, which steps it by NeedleSteering.step, observations copied."""

    def __init__(self, build, scene, number, steps):
        line = [sys.executable, os.path.abspath(__file__), "--build", str(build), "--steps", str(steps), "--actor",
                str(number), str(scene)]
        self.process = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def begin(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def answer(self):
        """Seconds, and processor time, s."""
        return [float(word) for word in self.process.stdout.readline().split()]

    def end(self):
        self.process.stdin.close()
        self.process.wait()


def act(scene, number, steps):
    """The process: a round for each line that comes."""
    from brachyd.steering import NeedleSteering, SteeringSettings
    environment = NeedleSteering(SteeringSettings(scene=scene, holes_mm=HOLES))
    wanted = actions(steps, 2)[:, number]
    print(0, 0, flush=True)  # ready
    for _ in sys.stdin:
        environment.reset(seed=1 + number)
        used, begin, is_over = processor_s(), time.perf_counter(), False
        for action in wanted:
            if is_over:
                environment.reset()
                is_over = False
            else:
                _, _, terminated, truncated, _ = environment.step(action)
                is_over = terminated or truncated
        print(time.perf_counter() - begin, processor_s() - used, flush=True)


def actors_round(actors, steps):
    """Ticks a second of all, and processor time a tick, s."""
    for actor in actors:
        actor.begin()
    seconds, used = zip(*(actor.answer() for actor in actors))
    ticks = steps * len(actors)
    return ticks / max(seconds), sum(used) / ticks


def cpp_round(loop, scene, poses):
    said = subprocess.run([loop, scene, poses], check=True, capture_output=True, text=True).stdout
    rate, used = re.match(r"([\d.e+]+) ticks/s, ([\d.e+]+) us", said).groups()
    return float(rate), 1e-6 * float(used)


def measure(build, text, options):
    """Rounds of C++, actors and a vector: rate and processor time a tick of each."""
    from brachyd.steering import SteeringSettings
    from brachyd.vector import VectorNeedleSteering
    settings = SteeringSettings(text=text, holes_mm=HOLES)
    wanted = actions(options.steps, options.environments)
    with tempfile.TemporaryDirectory() as folder, \
            VectorNeedleSteering(options.environments, settings, processes=2, copy=False) as environment:
        scene, poses = pathlib.Path(folder, "scene.toml"), pathlib.Path(folder, "poses")
        scene.write_text(text, encoding="ascii")
        poses_of(settings, environment, actions(options.steps, 2), seed=1).tofile(poses)
        acting = [Actor(build, scene, number, options.steps) for number in range(2)]
        for actor in acting:
            actor.answer()
        rounds, loop = [], build / "bin/engine_loop"
        cpp = [cpp_round(loop, scene, poses)]
        for _ in range(options.rounds):
            rounds.append({"actors": actors_round(acting, options.steps)})
            cpp.append(cpp_round(loop, scene, poses))
            rounds[-1]["vector"] = python_round(environment, wanted, 1)
            cpp.append(cpp_round(loop, scene, poses))
        for actor in acting:
            actor.end()
    return cpp, rounds


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--environments", type=int, default=8, help="of the vector")
    parser.add_argument("--steps", type=int, default=800, help="of each environment and round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--actor", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    build = (ROOT / options.build).resolve()
    sys.path[:0] = [str(ROOT / "apps/python"), str(build / "python")]
    if options.actor:
        return act(options.actor[1], int(options.actor[0]), options.steps)
    is_reached = True
    for name, text in SCENES.items():
        cpp, rounds = measure(build, text, options)
        for number, (way, what) in enumerate((("actors", "two processes with an environment each"),
                                              ("vector", f"a vector of {options.environments} on two processes"))):
            ratios = [r[way][0] / statistics.mean((cpp[2 * k + number][0], cpp[2 * k + number + 1][0]))
                      for k, r in enumerate(rounds)]
            ratio = statistics.median(ratios)
            if way == "actors":
                is_reached &= ratio >= REQUIRED
            cpp_s, python_s = (statistics.median(x) for x in ([c[1] for c in cpp], [r[way][1] for r in rounds]))
            print(f"{name}, {what}: {statistics.median(r[way][0] for r in rounds):.0f} ticks/s, ratio {ratio:.2f} to "
                  f"C++ ({min(ratios):.2f} to {max(ratios):.2f}"
                  f"{f', at least {REQUIRED} is asked for' if way == 'actors' else ''}); processor time a tick "
                  f"{1e6 * python_s:.0f} and {1e6 * cpp_s:.0f} us, by which 2 cores make {2 * cpp_s / python_s:.2f}; "
                  f"load {os.getloadavg()[0]:.1f}", flush=True)
    return 0 if is_reached else 1


if __name__ == "__main__":
    sys.exit(main())
