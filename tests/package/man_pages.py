#!/usr/bin/python3
"""Holds the manuals against what the programs' --help says: each option, each command, each example is there.

usage: man_pages.py DIR PROGRAM…
"""
import gzip
import pathlib
import re
import shutil
import subprocess
import sys


def help_of(*command):
    return subprocess.run([*command, "--help"], check=True, capture_output=True, text=True).stdout


def missing_package(binary, command):
    """The package of a command's own program, where this build lacks it; else None."""
    done = subprocess.run([binary, command, "--help"], capture_output=True, text=True)
    found = re.search(r"cannot be run .* install the package ([a-z-]+)", done.stderr)
    return found[1] if done.returncode == 2 and found else None


def check(program, binary, folder):
    file = pathlib.Path(folder) / f"{program}.1.gz"
    text = gzip.decompress(file.read_bytes()).decode()
    plain = re.sub(r"\\f.", "", text).replace("\\-", "-").replace("\\&", "").replace("\\e", "\\")
    sections = {"": plain[: plain.find(".SH COMMANDS")] if ".SH COMMANDS" in plain else plain}
    for section in plain.split('.SS "')[1:]:
        sections[section.split()[1]] = section
    wanted = [("", help_of(binary))]
    if "\nSubcommands:\n" in wanted[0][1]:
        names = re.findall(r"^  ([a-z][\w-]*) ", wanted[0][1].split("Subcommands:")[1].split("\n\n")[0], re.M)
        assert names, program
        for name in names:
            package = missing_package(binary, name)
            if package:
                assert f"It is in the package {package}." in plain, f"{program}(1) does not say where {name} is"
            else:
                wanted.append((name, help_of(binary, name)))
    for name, said in wanted:
        assert name in sections, f"{program}(1) has no command {name}"
        options = re.findall(r"^  (?:-\w,)?(--[\w-]+)", said, re.M)
        assert options, f"{program} {name}"
        for option in set(options) - {"--help"}:
            assert re.search(
                rf"^{option}( [A-Z]+( \.\.\.)?)?$", sections[name], re.M
            ), f"{program}(1): {name} {option} is missing"
        for example in re.findall(rf"^  ({program} .*)$", said, re.M):
            assert example.replace("…", "...") in plain, f"{program}(1): the example {example!r} is missing"
    if shutil.which("man"):
        shown = subprocess.run(
            ["man", "--warnings", "-E", "UTF-8", "-l", file],
            capture_output=True,
            text=True,
            env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "MANWIDTH": "100", "MAN_KEEP_STDERR": "1"},
        )
        assert shown.returncode == 0 and not shown.stderr, shown.stderr


if __name__ == "__main__":
    for binary in sys.argv[2:]:
        check(pathlib.Path(binary).name, binary, sys.argv[1])
