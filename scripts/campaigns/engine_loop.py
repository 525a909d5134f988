#!/usr/bin/env python3
"""Ticks a second of the engine in Python against the same loop in C++: the best of some rounds of each, in turn.

usage: scripts/campaigns/engine_loop.py [BUILD [KERNEL [TICKS]]]     build/release, psi31 and 20000 by default
"""
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROUNDS = 5


def rate(line, environment=None):
    said = subprocess.run(line, check=True, capture_output=True, text=True, env=environment).stdout
    return [float(number) for number in re.findall(r"([\d.e+]+) ticks/s", said)]


def main(build, kernel, ticks):
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'apps/python'}:{build / 'python'}"}
    example = ROOT / "apps/python/examples/ticks_per_second.py"
    cpp, python = [], []
    for _ in range(ROUNDS):
        cpp += rate([build / "bin/engine_loop", kernel, ticks])
        python.append(rate(["/usr/bin/python3", example, kernel, ticks], environment))
    in_one, each = (max(column) for column in zip(*python))
    print(f"{kernel}: C++ {max(cpp):.0f} ticks/s; Python in one call {in_one:.0f} ({in_one / max(cpp):.2f} of it), "
          f"a call each {each:.0f} ({each / max(cpp):.2f})")


if __name__ == "__main__":
    if len(sys.argv) > 4:
        sys.exit(__doc__)
    words = sys.argv[1:] + ["build/release", "psi31", "20000"][len(sys.argv) - 1:]
    main((ROOT / words[0]).resolve(), *words[1:])
