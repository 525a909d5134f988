#!/usr/bin/env python3
"""scripts/conformance fails clients that make mistakes, by the check that is about the mistake.

usage: tests/scripts/conformance_test.py     exit code 77: skipped, with its reason
"""
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON = "/usr/bin/python3"  # Debian's, which has numpy
if subprocess.run([PYTHON, "-c", "import numpy"], stderr=subprocess.DEVNULL, check=False).returncode != 0:
    print("skipped: python3-numpy is missing")
    sys.exit(77)
# tests/conformance/client.py as it is, with a mistake put in before it runs.
START = f"""
import sys
sys.path.insert(0, {str(ROOT / "tests/conformance")!r})
import client
from brachyd import protocol, wire
{{mistake}}
client.main()
{{after}}
"""


def checks(conversation, mistake, after=""):
    """(exit code, names of the checks that failed) of a client with a mistake."""
    line = [ROOT / "scripts/conformance/run.py", "--only", conversation, "--", PYTHON, "-c",
            START.format(mistake=mistake, after=after)]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    return done.returncode, [line.split(":")[0].split(None, 1)[1] for line in done.stdout.splitlines()
                             if line.startswith("FAILED")]


class Mistakes(unittest.TestCase):
    def test_the_client_as_it_is_passes(self):
        self.assertEqual(checks("documented_messages", ""), (0, []))

    def test_each_mistake_is_found_by_its_check(self):
        needle = "type(client.brachyd.Protocol(client.brachyd.Hello())).needle = property(lambda self: 0)"
        flags = "protocol.wire.encode_message = lambda kind, body, *rest, f=wire.encode_message: " \
                "bytes(8) and f(kind, body, *rest)[:8] + b'\\1' + f(kind, body, *rest)[9:]"
        gap = "protocol.wire.encode_message = lambda kind, body, sequence, stamp, f=wire.encode_message: " \
              "f(kind, body, sequence + 1, stamp)"
        for conversation, mistake, after, name in (
                ("device", needle, "", "needle"),
                ("device", "client.math.isnan = lambda number: False", "", "no pose while tracking is lost"),
                ("device", "client.max = lambda *two: 0.001", "", "pose rate"),
                ("device", "sys.argv[3] = 'viewer'", "", "device"),
                ("documented_messages", flags, "", "hello first"),
                ("documented_messages", gap, "", "hello first"),
                ("documented_messages", "del sys.argv[4:]", "", "token"),
                ("documented_messages", "client.say = lambda key, value: print(key)", "", "welcome"),
                ("refused", "", "sys.exit(1)", "refused with a reason")):
            with self.subTest(name, mistake=mistake):
                code, failed = checks(conversation, mistake, after)
                self.assertEqual((code, failed[:1]), (1, [name]))


if __name__ == "__main__":
    unittest.main()
