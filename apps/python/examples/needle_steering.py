#!/usr/bin/env python3
"""Three ways to steer a bevelled needle to targets that it can reach, and how well each does: a table.

Mean error with its 95 % interval (bootstrap over targets), share of targets that are reached with Wilson's, all
on the same targets; steps a second of all environments together, policy included.

usage: needle_steering.py [--targets N] [--within MM] [--processes N] [--environments N] [--scene FILE] [--seed N]
"""
import argparse
import time
from typing import Tuple

import numpy as np
import numpy.typing as npt

from brachyd.baselines import POLICIES, play
from brachyd.steering import Outcome, SteeringSettings
from brachyd.vector import VectorNeedleSteering

RESAMPLES = 10_000


def interval_of_mean(values: npt.NDArray[np.float64]) -> Tuple[float, float]:
    """95 %, by the bootstrap's percentiles."""
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = np.percentile(values[drawn].mean(axis=1), [2.5, 97.5])
    return float(low), float(high)


def interval_of_share(hits: int, n: int) -> Tuple[float, float]:
    """95 %, Wilson's."""
    z = 1.959964
    middle, half = hits + z * z / 2, z * np.sqrt(hits * (n - hits) / n + z * z / 4)
    return float((middle - half) / (n + z * z)), float((middle + half) / (n + z * z))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--targets", type=int, default=120, help="of each policy; rounded up to the environments")
    parser.add_argument("--within", type=float, default=0.5, metavar="MM", help="a target this near is reached")
    parser.add_argument("--processes", type=int, help="all cores by default")
    parser.add_argument("--environments", type=int, default=8)
    parser.add_argument("--scene", help="a scene's file; the default is steering.SCENE")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    episodes = -(-options.targets // options.environments)
    settings = SteeringSettings(scene=options.scene)
    print(f"| policy | targets | within {options.within} mm | error, mm | median, mm | in organs | steps/s |\n"
          "|---|---|---|---|---|---|---|")
    with VectorNeedleSteering(options.environments, settings, processes=options.processes) as environment:
        for name, policy in POLICIES.items():
            begin = time.perf_counter()
            played = play(environment, policy(environment), episodes, options.seed)
            seconds = time.perf_counter() - begin
            error, n = played.error_mm, len(played.error_mm)
            hits = int(np.sum((error <= options.within) & (played.outcome == Outcome.AT_DEPTH)))
            low, high = interval_of_mean(error)
            few, many = (100 * share for share in interval_of_share(hits, n))
            print(f"| {name} | {n} | {100 * hits / n:.0f} % ({few:.0f} … {many:.0f}) | {error.mean():.2f} ({low:.2f} … "
                  f"{high:.2f}) | {np.median(error):.2f} | {np.sum(played.outcome == Outcome.ORGAN)} | "
                  f"{(played.ticks.sum() + n) / seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
