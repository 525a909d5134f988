#!/usr/bin/env python3
"""net/c_api/brachyd_client.h compiles as C99 and as C++11 without a warning, and the library exports the functions that
it declares, with a version, and nothing else.

usage: tests/net/c_api/header_test.py LIBRARY     exit code 77: skipped, with its reason
"""
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

C_API = pathlib.Path(__file__).resolve().parents[3] / "net/c_api"
HEADER = C_API / "brachyd_client.h"
STRICT = ["-Wall", "-Wextra", "-pedantic", "-Wstrict-prototypes", "-Werror", "-fsyntax-only"]
if len(sys.argv) < 2:
    sys.exit(__doc__)
LIBRARY = sys.argv[1]
for program in ("gcc", "g++", "nm"):
    if not shutil.which(program):
        print(f"skipped: {program} is missing")
        sys.exit(77)


def declared():
    return set(re.findall(r"^BRACHYD_API .*?(brachyd_\w+)\(", HEADER.read_text(encoding="utf-8"), re.M))


class Header(unittest.TestCase):
    def compiles(self, *line):
        text = '#include "brachyd_client.h"\nint main(void) { return brachyd_is_open(0); }\n'
        done = subprocess.run([*line, f"-I{C_API}", "-"], input=text, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_compiles_as_c99_and_as_cpp11_without_a_warning(self):
        self.compiles("gcc", "-x", "c", "-std=c99", *STRICT)
        self.compiles("g++", "-x", "c++", "-std=c++11", *(flag for flag in STRICT if flag != "-Wstrict-prototypes"))
        if shutil.which("clang-14"):
            self.compiles("clang-14", "-x", "c", "-std=c99", "-Weverything", "-Wno-padded",
                          "-Wno-declaration-after-statement", *STRICT)

    def test_says_what_every_function_is(self):
        before = re.findall(r"(\*/|\S)\n+BRACHYD_API ", HEADER.read_text(encoding="utf-8"))
        self.assertEqual(len(before), len(declared()))
        self.assertEqual(set(before), {"*/"})


class Library(unittest.TestCase):
    def test_exports_the_declared_functions_with_a_version_and_nothing_else(self):
        listed = subprocess.run(["nm", "-D", "--defined-only", LIBRARY], capture_output=True, text=True, check=True)
        exported = [line.split()[-1] for line in listed.stdout.splitlines()]
        functions = {name.partition("@@")[0] for name in exported if "@@" in name}
        self.assertEqual(functions, declared())
        nodes = {name.partition("@@")[2] for name in exported if "@@" in name}
        self.assertEqual(nodes, {"BRACHYD_CLIENT_0.1"})
        self.assertLessEqual({name for name in exported if "@@" not in name}, nodes)

    def test_needs_no_library_of_the_simulation(self):
        needed = subprocess.run(["readelf", "-d", LIBRARY], capture_output=True, text=True, check=True).stdout
        self.assertIn("[libbrachyd-client.so.0]", needed)
        self.assertNotRegex(needed, "NEEDED.*(assimp|gomp|spdlog|nats|systemd)")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
