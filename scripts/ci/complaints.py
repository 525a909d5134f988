"""What the checks of this folder that only read sources share: their command line, and how they end."""
import argparse
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def root_of(description):
    """The repository that the command line names with --root, by default this one."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=ROOT)
    return parser.parse_args().root


def end(name, complaints, ok):
    """Ends with 1 and a line for each complaint on standard error; without any prints `ok`."""
    complaints = list(complaints)
    for complaint in complaints:
        print(f"{name}:", complaint, file=sys.stderr)
    if complaints:
        sys.exit(1)
    print(f"{name}: ok, {ok}")
