#!/usr/bin/env python3
"""Measures the time from sending a pose to its FORCE, at the rate given, and prints quantiles in ms.

usage: round_trip.py HOST:PORT [RATE_HZ [SECONDS]]
"""
import sys
import time

import numpy as np

import brachyd


def main(address: str, rate_hz: float, seconds: float) -> None:
    hello = brachyd.Hello(brachyd.Role.DEVICE, "round_trip.py", brachyd.Subscription.NO_MESH, rate_hz=rate_hz)
    times_ms = []
    with brachyd.Client(address, hello) as device:
        sent = {}
        begin = due = time.monotonic()
        while (now := time.monotonic()) < begin + seconds:
            if now >= due:
                due += 1 / rate_hz
                sent[device.send_pose(brachyd.unit_pose([5, 0, -60 + 0.01 * (len(sent) % 5000)]))] = now
            for message in device.poll(max(0.0, due - time.monotonic())):
                if isinstance(message, brachyd.Force) and message.input_sequence in sent:
                    times_ms.append(1e3 * (time.monotonic() - sent[message.input_sequence]))
    p50, p99, most = np.quantile(times_ms, [0.5, 0.99, 1])
    print(f"{len(times_ms)} forces of {len(sent)} poses: p50 {p50:.2f} ms, p99 {p99:.2f} ms, most {most:.2f} ms")


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    main(sys.argv[1], *(float(text) for text in sys.argv[2:] + ["1000", "5"][len(sys.argv) - 2:]))
