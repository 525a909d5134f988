#!/usr/bin/env python3
"""Judges a client of brachyd's native protocol: what it sends, and what it makes of what it gets.

usage: scripts/conformance/run.py [--brachyd PROGRAM] [--only NAME] -- CLIENT [ARGUMENT…]
    CLIENT is started with HOST PORT ROLE and, where the server asks for one, TOKEN behind its own arguments, once for
    each conversation, and prints what it received: scripts/conformance/README.md
    --brachyd: the daemon for the conversations with a real one; default: that of build/release, or in PATH
    --only: one conversation, a function of conversations.py or live.py

Prints a line for each check with the sentence of net/PROTOCOL.md that it stands for. Exit code 0: all passed; 1: some
did not; 2: they could not be run. Without a daemon its conversations are left out, which is said.
"""
import argparse
import pathlib
import shutil
import sys

sys.dont_write_bytecode = True  # nothing is left beside what a package has installed
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import conversations  # pylint: disable=wrong-import-position
import live  # pylint: disable=wrong-import-position
from judge import ROOT, Verdicts  # pylint: disable=wrong-import-position


def daemon(given):
    """The daemon's program, or None."""
    if given:
        if not shutil.which(given):
            sys.exit(f"conformance: {given} is no program")
        return given
    return shutil.which(str(ROOT / "build/release/bin/brachyd")) or shutil.which("brachyd")


def main():
    if sys.argv[1:] in (["--help"], ["-h"]):
        print(__doc__.strip())
        return 0
    if "--" not in sys.argv:
        sys.stderr.write(__doc__)
        return 2
    split = sys.argv.index("--")
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--brachyd")
    parser.add_argument("--only", default="")
    options = parser.parse_args(sys.argv[1:split])
    command = sys.argv[split + 1:]
    if not command or not shutil.which(command[0]):
        sys.stderr.write("conformance: name the client's program behind --\n")
        return 2
    verdicts = Verdicts()
    scripted = [one for one in conversations.ALL if options.only in ("", one.__name__)]
    real = [one for one in live.ALL if options.only in ("", one.__name__)]
    if not scripted and not real:
        sys.stderr.write(f"conformance: there is no conversation {options.only}\n")
        return 2
    for conversation in scripted:
        verdicts.hold(conversation, command)
    brachyd = daemon(options.brachyd) if real else None
    if brachyd:
        with live.Daemon(brachyd) as running:
            for conversation in real:
                verdicts.hold(conversation, command, running)
    verdicts.show()
    if real and not brachyd:
        print("conformance: no brachyd, so the conversations with a real one were left out: --brachyd PROGRAM")
    return 0 if verdicts.are_good() else 1


if __name__ == "__main__":
    sys.exit(main())
