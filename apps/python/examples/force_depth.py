#!/usr/bin/env python3
"""The force of an insertion against depth, without a daemon: the capsule gives way, the needle cuts, and is drawn out.

usage: force_depth.py [SCENE.toml]
"""
import sys
from typing import Optional

import numpy as np

import brachyd


def main(scene: Optional[str]) -> None:
    simulator = brachyd.Simulator(scene)
    speed_mm = 5 * simulator.period_s  # 5 mm/s
    way = np.arange(-40, 10, speed_mm)
    tips = np.concatenate([way, way[::-1]])
    poses = np.tile(np.eye(4), (len(tips), 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = 5, tips
    ticks = simulator.run(poses)
    depth, axial = ticks.tip_depth_mm[:, 0], ticks.axial_n[:, 0]
    inside = np.flatnonzero(ticks.contact[:, 0] == 2)
    print(f"the capsule gave way at {axial[inside[0] - 1]:.2f} N, {depth[inside[0] - 1]:.1f} mm deep")
    print(f"deepest {depth.max():.1f} mm; most {axial.max():.2f} N in, {-axial.min():.2f} N out")
    print(f"tissue moved by {ticks.max_displacement_mm.max():.1f} mm at most; "
          f"injective in {np.mean(ticks.verdict == 1):.1%} of {len(tips)} ticks")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    main(sys.argv[1] if len(sys.argv) == 2 else None)
