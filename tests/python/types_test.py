#!/usr/bin/env python3
"""The types of apps/python hold: mypy --strict.

usage: tests/python/types_test.py     exit code 77: skipped, with its reason
"""
import importlib.util
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]

if importlib.util.find_spec("mypy") is None:
    print("skipped: mypy is missing (scripts/setup.sh --tests)")
    sys.exit(77)
with tempfile.TemporaryDirectory() as cache:
    line = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, "brachyd"]
    sys.exit(subprocess.run(line, cwd=ROOT / "apps/python", check=False).returncode)
