#!/usr/bin/env python3
"""`brachy import` on other projects' files: each folder with DICOM, NRRD, NIfTI or MetaImage, and each such file by
itself, imports or is refused in one line, within 5 s and 1 GiB. The files are fetched by hand and stay where they are.

usage: public_cases.py BRACHY_IMPORT FOLDER…     prints a table, a row for each folder; exit code 1 where one is wrong
"""
import json
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

ENDINGS = (".dcm", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha", ".mhd")
MOST_S, MOST_BYTES = 5, 1 << 30


def is_of_images(file):
    return file.is_file() and (file.name.lower().endswith(ENDINGS) or file.read_bytes()[128:132] == b"DICM")


def one_import(program, source, out):
    """What came of it, and what is wrong with that."""
    shutil.rmtree(out, ignore_errors=True)
    began = time.monotonic()
    ended = subprocess.run([program, "import", source, "--out", out], capture_output=True, text=True,
                           preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (4 * MOST_BYTES,) * 2))
    took = time.monotonic() - began
    wrong = [f"took {took:.1f} s"] if took > MOST_S else []
    lines = [line for line in ended.stderr.splitlines() if re.match(r"brachy[^ ]*: ", line)]
    if ended.returncode == 0:
        report = json.loads((out / "import.json").read_text())
        off = [s["name"] for s in report["structures"]
               if abs(s["surface_cc"] - s["source_cc"]) > 0.01 * s["source_cc"] + 0.001]
        return "imported", wrong + [f"{name}: other volume than in the file" for name in off]
    if ended.returncode != 2 or len(lines) != 1 or out.exists():
        wrong.append(f"exit code {ended.returncode}, {len(lines)} lines")
    return lines[0][8:] if lines else "", wrong


def main():
    program, folders = sys.argv[1], [pathlib.Path(folder) for folder in sys.argv[2:]]
    all_wrong = 0
    print("| files of | folders, imported | files, imported | refused in a line | wrong |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as work:
        for root in folders:
            files = sorted(file for file in root.rglob("*") if is_of_images(file))
            counts, wrong = {}, []
            for kind, sources in (("folders", sorted({file.parent for file in files})), ("files", files)):
                results = [(source, *one_import(program, source, pathlib.Path(work) / "out")) for source in sources]
                counts[kind] = (len(results), sum(what == "imported" for _, what, _ in results))
                wrong += [f"{source.relative_to(root)}: {'; '.join(faults)}" for source, _, faults in results if faults]
            all_wrong += len(wrong)
            (f, fi), (n, ni) = counts["folders"], counts["files"]
            print(f"| {root.name} | {f}, {fi} | {n}, {ni} | {f - fi + n - ni} | {len(wrong)} |", flush=True)
            for line in wrong:
                print(f"public_cases: {line}", file=sys.stderr)
    # Of all imports: what the largest took.
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
    print(f"\nThe largest import took {peak / 2**20:.0f} MiB.")
    sys.exit(1 if all_wrong or peak > MOST_BYTES else 0)


if __name__ == "__main__":
    main()
