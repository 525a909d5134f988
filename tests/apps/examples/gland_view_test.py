#!/usr/bin/env python3
"""The OpenGL example on a virtual screen (Xvfb) against a running brachyd: its picture has gland, dent and needle.

usage: tests/apps/examples/gland_view_test.py GLAND_VIEW BRACHYD     exit code 77: skipped, with its reason
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
if len(sys.argv) < 3:
    sys.exit(__doc__)
GLAND_VIEW, BRACHYD = (os.path.abspath(program) for program in sys.argv[1:3])
if not shutil.which("Xvfb"):
    print("skipped: Xvfb is missing: apt-get install xvfb")
    sys.exit(77)


def picture_of(path):
    """Its red, green, blue of each pixel."""
    data = path.read_bytes()
    head = re.match(rb"P6 (\d+) (\d+) 255\n", data)
    pixels = data[head.end():]
    assert len(pixels) == 3 * int(head[1]) * int(head[2])
    return [tuple(pixels[i:i + 3]) for i in range(0, len(pixels), 3)]


class GlandView(unittest.TestCase):
    def started(self, line, **options):
        process = subprocess.Popen(line, stderr=subprocess.DEVNULL, **options)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return process

    def test_shows_gland_dent_and_needle(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        read, write = os.pipe()
        # It chooses a display that is free, and writes its number.
        screen = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1024x768x24", "-nolisten", "tcp"]
        self.started(screen, pass_fds=[write])
        os.close(write)
        with os.fdopen(read) as told:
            display = told.readline().strip()
        if not display:
            self.skipTest("Xvfb does not start here")
        daemon = self.started([BRACHYD, "--port", "0", "--trajectory", ROOT / "config/insertion.csv", "--play",
                               "--duration", "300"], stdout=subprocess.PIPE, text=True)
        self.addCleanup(daemon.stdout.close)
        port = re.search(r":(\d+)$", daemon.stdout.readline())[1]
        picture = pathlib.Path(folder.name) / "gland.ppm"
        done = subprocess.run([GLAND_VIEW, "127.0.0.1", port, picture], env=os.environ | {"DISPLAY": f":{display}"},
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        pixels = picture_of(picture)
        gland = sum(r > 60 and r > g > 0 for r, g, b in pixels)
        dent = sum(r > 60 and r > 1.8 * g for r, g, b in pixels)
        needle = sum(r > 200 and b > 200 for r, g, b in pixels)
        self.assertGreater(gland, 0.05 * len(pixels))
        self.assertGreater(dent, 50)
        self.assertGreater(needle, 200)
        self.assertLess(gland, 0.5 * len(pixels))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
