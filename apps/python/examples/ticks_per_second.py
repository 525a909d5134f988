#!/usr/bin/env python3
"""Ticks a second of the engine in this process: poses in one call, and a call a tick.

usage: ticks_per_second.py [KERNEL [TICKS]]     psi31 and 20000 by default
"""
import sys
import time

import numpy as np

import brachyd


def main(kernel: str, ticks: int) -> None:
    simulator = brachyd.Simulator(text=f'[model]\nkernel = "{kernel}"\n')
    poses = np.tile(np.eye(4), (ticks, 1, 1))
    poses[:, 0, 3] = 5
    poses[:, 2, 3] = -10 - 20 * np.cos(np.arange(ticks) * 2 * np.pi / 2000)  # in and out in 10 s of simulated time
    for name, play in (("in one call", lambda: simulator.run(poses)),
                       ("a call each", lambda: [simulator.step(X) for X in poses])):
        simulator.reset()
        begin = time.perf_counter()
        play()
        seconds = time.perf_counter() - begin
        print(f"{kernel}, {len(simulator.positions)} points, {name}: {ticks / seconds:.0f} ticks/s, "
              f"{ticks * simulator.period_s / seconds:.0f} times real time")


if __name__ == "__main__":
    if len(sys.argv) > 3:
        sys.exit(__doc__)
    main(sys.argv[1] if len(sys.argv) > 1 else "psi31", int(sys.argv[2]) if len(sys.argv) > 2 else 20000)
