#!/usr/bin/env python3
"""The client of scripts/conformance/README.md on apps/python: HOST PORT ROLE [TOKEN]. Prints what it receives."""
import json
import math
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "apps/python"))
import brachyd  # pylint: disable=wrong-import-position
from brachyd import wire  # pylint: disable=wrong-import-position


def say(key, value):
    print(json.dumps({key: value}), flush=True)


def checksum(positions):
    """64-bit FNV-1a over the points' bytes."""
    value = 0xcbf29ce484222325
    for byte in positions.astype("<f4").tobytes():
        value = (value ^ byte) * 0x100000001b3 % 2**64
    return f"{value:016x}"


def track(k):
    """The tracker's pose number k: a straight needle; in some of them it has lost the needle."""
    return brachyd.unit_pose([math.nan if k % 50 in (10, 11) else 5, 0, -30 + 0.25 * min(k, 240)])


class Reporter:
    """Prints what is new."""

    def __init__(self):
        self.topology = self.frame = None

    def mesh(self, protocol):
        if protocol.topology is not self.topology:
            self.topology = protocol.topology
            say("topology", {"hash": f"{self.topology.hash:016x}", "points": len(self.topology.rest),
                             "triangles": len(self.topology.triangles)})
        if protocol.frame is not self.frame:
            self.frame = protocol.frame
            say("frame", {"tick": self.frame.tick, "mesh": checksum(protocol.positions)})

    @staticmethod
    def error(error):
        say("error", {"code": int(error.code), "fatal": int(error.fatal), "text": error.text})

    def messages(self, messages):
        for message in messages:
            if isinstance(message, wire.Force):
                say("force", {"input_stamp_ns": message.input_stamp_ns, "force_n": list(message.forces.force_n)})
            elif isinstance(message, wire.Event):
                say("event", {"kind": int(message.kind), "text": message.text})
            elif isinstance(message, wire.Error):
                self.error(message)


def serve(client, is_device, report):
    welcome = client.protocol.welcome
    say("welcome", {"role": int(welcome.role), "needle": welcome.needle, "server": welcome.server})
    report.messages(client.errors)
    interval_s = max(0.01, 1 / max(welcome.max_poses_per_s, 1))
    k, next_s, was_latched = 0, time.monotonic(), False
    while True:
        report.mesh(client.protocol)
        messages = client.poll(max(0.0, next_s - time.monotonic()) if is_device else 0.5)
        report.messages(messages)
        for force in (message for message in messages if isinstance(message, wire.Force)):
            is_latched = bool(force.flags & brachyd.ForceFlag.LATCHED)
            if is_latched and not was_latched:
                client.arm()
            was_latched = is_latched
        if is_device and time.monotonic() >= next_s:
            pose = track(k)
            k, next_s = k + 1, time.monotonic() + interval_s
            if not any(map(math.isnan, pose.flat)):
                client.send_pose(pose)


def main():
    host, port, role = sys.argv[1:4]
    is_device = role == "device"
    token = bytes.fromhex(sys.argv[4]) if len(sys.argv) > 4 else None
    hello = brachyd.Hello(brachyd.Role.DEVICE if is_device else brachyd.Role.VIEWER, "conformance in Python",
                          brachyd.Subscription.NO_MESH if is_device else brachyd.Subscription(0), token=token)
    report = Reporter()
    try:
        with brachyd.Client(f"{host}:{port}", hello) as client:
            serve(client, is_device, report)
    except brachyd.ServerError as refusal:
        report.error(refusal.error)
        say("closed", refusal.error.text)
    except (brachyd.ProtocolError, OSError) as problem:
        say("closed", str(problem))


if __name__ == "__main__":
    main()
