#!/usr/bin/env python3
"""apps/csharp compiled and run by mono: its client before scripts/conformance, and the Unity script against a running
brachyd, with a stub of UnityEngine.

usage: tests/apps/csharp/csharp_test.py LIBRARY_DIR BRACHYD     exit code 77: skipped, with its reason
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
BINDING = ROOT / "apps/csharp/BrachydClient.cs"
if len(sys.argv) < 3:
    sys.exit(__doc__)
LIBRARY_DIR, BRACHYD = (os.path.abspath(given) for given in sys.argv[1:3])
if not shutil.which("mcs") or not shutil.which("mono"):
    print("skipped: mono is missing: apt-get install mono-mcs mono-runtime")
    sys.exit(77)
ENVIRONMENT = os.environ | {"LD_LIBRARY_PATH": LIBRARY_DIR}


# Structs of the C API, by their names in C#.
STRUCTS = {"Options": "Options", "Welcome": "Welcome", "Native.TopologyView": "Topology", "Frame": "Frame",
           "Needle": "Needle", "Seed": "Seed", "Force": "Force", "State": "State", "Event": "Event", "Error": "Error",
           "Native.ImageView": "Image", "Scanner": "Scanner"}


class CSharp(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def compiled(self, name, *sources):
        program = os.path.join(self.folder.name, name)
        line = ["mcs", "-langversion:7", "-warn:4", "-warnaserror", f"-out:{program}", BINDING, *sources]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))
        return program

    def written(self, name, text):
        path = pathlib.Path(self.folder.name) / name
        path.write_text(text, encoding="utf-8")
        return path

    def test_its_structs_have_the_sizes_of_the_headers(self):
        in_c = "".join(f'  printf("%zu\\n", sizeof(Brachyd{name}));\n' for name in STRUCTS.values())
        c = self.written("sizes.c", f"#include <brachyd_client.h>\n#include <stdio.h>\nint main(void) {{\n{in_c}}}\n")
        subprocess.run(["gcc", "-std=c99", f"-I{ROOT}/net/c_api", c, "-o", c.with_suffix("")], check=True)
        in_cs = "".join(f"Console.WriteLine(Marshal.SizeOf(typeof({name})));" for name in STRUCTS)
        cs = self.written("Sizes.cs", "using System; using System.Runtime.InteropServices; using Brachyd;"
                                      f"static class Sizes {{ static void Main() {{ {in_cs} }} }}")
        sizes = [subprocess.run(line, capture_output=True, text=True, check=True).stdout.split()
                 for line in ([c.with_suffix("")], ["mono", self.compiled("sizes.exe", cs)])]
        self.assertEqual(dict(zip(STRUCTS, sizes[1])), dict(zip(STRUCTS, sizes[0])))

    def test_its_client_passes_the_conformance_checks(self):
        program = self.compiled("client.exe", ROOT / "tests/conformance/Client.cs")
        done = subprocess.run([ROOT / "scripts/conformance/run.py", "--brachyd", BRACHYD, "--", "mono", program],
                              env=ENVIRONMENT, stdout=subprocess.PIPE, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_the_unity_script_shows_the_gland_the_right_way_round(self):
        program = self.compiled("unity.exe", ROOT / "apps/csharp/examples/GlandMesh.cs",
                                ROOT / "tests/apps/csharp/UnityStub.cs")
        line = [BRACHYD, "--port", "0", "--trajectory", ROOT / "config/insertion.csv", "--play", "--duration", "300"]
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as daemon:
            try:
                port = re.search(r":(\d+)$", daemon.stdout.readline())[1]
                done = subprocess.run(["mono", program, port], env=ENVIRONMENT, capture_output=True, text=True,
                                      check=False)
            finally:
                daemon.terminate()
        found = re.fullmatch(r"1200 vertices, 2396 triangles, ([0-9.]+) m wide, volume ([0-9.]+) cm3\n", done.stdout)
        self.assertTrue(found, done)
        self.assertAlmostEqual(float(found[1]), 0.05, delta=0.002)
        self.assertAlmostEqual(float(found[2]), 47, delta=2)  # above 0: Unity's side of the triangles is the outside


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
