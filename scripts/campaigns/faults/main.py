"""The cases of scripts/campaigns/faults.sh. Each starts its own daemon on a free port, harms it, and returns rows:
what was measured, its figure, its limit, and whether that was kept. Processes are ended by their id."""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile

import attack
import endings
import kills
import peers
import request_kinds
import spoilt
from programs import IS_SANITIZED, Row, findings

CASES = {
    "viewers": peers.viewers,
    "limit": peers.limit,
    "half-open": peers.half_open,
    "lies": peers.lies,
    "flood": peers.flood,
    "attack": attack.attack,
    "hand": attack.hand,
    "requests": request_kinds.requests,
    "stop": peers.stop,
    "descriptors": peers.descriptors,
    "disk": endings.disk,
    "load": peers.load,
    "relay": peers.relay,
    "kill": endings.kill,
    "kills": kills.kills,
    "spoilt": spoilt.spoilt,
    "sigterm": endings.sigterm,
    "start-stop": endings.start_stop,
}


def main():
    parser = argparse.ArgumentParser(prog="scripts/campaigns/faults.sh")
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--sanitized", action="store_true")
    parser.add_argument("--json")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=" ".join(CASES))
    options = parser.parse_args()
    unknown = [case for case in options.cases if case not in CASES]
    if unknown:
        parser.error(f"no case {unknown[0]}; there are {' '.join(CASES)}")
    work = tempfile.mkdtemp(prefix="faults_")
    rows = []
    for name in options.cases or CASES:
        folder = f"{work}/{name}"
        os.makedirs(folder)
        print(f"faults: {name}: {CASES[name].__doc__}", flush=True)
        failed = []
        try:
            of_case = CASES[name](folder, options.short)
        except (RuntimeError, OSError, KeyError, subprocess.SubprocessError) as error:
            of_case, failed = [], [Row(name, f"{type(error).__name__}: {error}", "", False)]
        if IS_SANITIZED:
            found = findings(folder)
            of_case = [Row(name, f"{len(found)} findings of the sanitizers " + "; ".join(found[:2]), "0", not found)]
        rows += of_case + failed
        for row in rows:
            if not hasattr(row, "shown"):
                print(f"  {'ok    ' if row.is_good else 'MISSED'}  {row.case:<32} {row.figure}", flush=True)
                row.shown = True
    print("\n| case | figure | limit | verdict |\n|---|---|---|---|")
    for row in rows:
        print(f"| {row.case.strip()} | {row.figure} | {row.limit} | {'ok' if row.is_good else '**missed**'} |")
    if options.json:
        with open(options.json, "w") as file:
            json.dump(
                [{"case": r.case.strip(), "figure": r.figure, "limit": r.limit, "ok": r.is_good} for r in rows],
                file,
                indent=1,
            )
    good = all(row.is_good for row in rows)
    if good:
        shutil.rmtree(work)
    else:
        print(f"faults: logs and files lie in {work}")
    return 0 if good else 1


sys.exit(main())
