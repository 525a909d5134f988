#!/usr/bin/env python3
"""A device that drives a needle into the gland and prints depth and force; the force comes over the wire.

Where the force is latched, because the device before left with its needle in the tissue, it says so and arms it.

usage: insertion.py HOST:PORT [DEPTH_MM]
"""
import sys

import brachyd


def main(address: str, depth_mm: float) -> None:
    hello = brachyd.Hello(brachyd.Role.DEVICE, "insertion.py", brachyd.Subscription.NO_MESH)
    with brachyd.Client(address, hello) as device:
        print(f"needle {device.protocol.needle} of {device.protocol.welcome.server}")
        z, is_armed = -60.0, False
        while z < depth_mm:
            z += 0.1
            answer = device.exchange(brachyd.unit_pose([5, 0, z]))
            if answer is not None and brachyd.ForceFlag.LATCHED in answer.flags and not is_armed:
                print("the force is latched at 0 N: arming it; it comes in over 0.5 s")
                device.arm()
                is_armed = True
            if answer is not None and round(10 * z) % 50 == 0:
                forces = answer.forces
                print(f"tip {z:6.1f} mm   axial {forces.axial_n:6.3f} N   lateral {forces.lateral_n:6.3f} N")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) == 3 else 10.0)
