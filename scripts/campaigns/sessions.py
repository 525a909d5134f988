#!/usr/bin/env python3
"""The sixteen sessions of tests/reference/sessions, each with one deliberate mistake: plays each offline and checks
that the score's first three findings name the mistake and that the perfect session has none; that the seeds as dropped
give the dose of the numpy sum (expected.json: 0.5 percentage points, 1 Gy); and that organs are entered as often as
they were, with the depth within 0.5 mm, and otherwise not at all. Standard library only.

  sessions.py BRACHY DIRECTORY [--quick] [--fresh] [NAME ...]     NAME: only these sessions
    --quick: on psi31 with 2,000 points: seconds a session in place of minutes
    --fresh: removes earlier ones of these names; otherwise DIRECTORY must not hold any
"""
import json
import math
import os
import shutil
import subprocess
import sys

REFERENCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../tests/reference/sessions")
sys.path.insert(0, REFERENCE)
import generators  # noqa: E402

QUICK = '[tissue]\npoints = 2000\n[model]\nkernel = "psi31"\n'
PERCENT, GY, MM = 0.5, 1.0, 0.5


def figure(report, structure, key):
    found = [s for s in report["dose"]["dropped"]["structures"] if s["name"] == structure]
    return found[0][key] if found else math.nan


def dose_errors(report, expected):
    """What differs from the oracle, one text each."""
    errors = []
    for name, value, limit in (
            ("V100_percent", figure(report, "prostate", "v100_percent"), PERCENT),
            ("V150_percent", figure(report, "prostate", "v150_percent"), PERCENT),
            ("D90_gy", figure(report, "prostate", "d90_gy"), GY),
            ("urethra_D30_gy", figure(report, "urethra", "d30_gy"), GY),
            ("rectum_D2cc_gy", figure(report, "rectum", "d2cc_gy"), GY)):
        if not abs(value - expected[name]) <= limit:
            errors.append(f"{name} {value:.2f}, not {expected[name]:.2f}")
    if report["seeds"]["dropped"] != expected["seeds"]:
        errors.append(f'{report["seeds"]["dropped"]} seeds fell, not {expected["seeds"]}')
    return errors


def organ_errors(report, organ):
    entered = report["structures_entered"]
    if organ is None:
        return [f'{e["structure"]} entered {e["passes"]} times' for e in entered]
    name, passes, depth = organ
    mine = [e for e in entered if e["structure"] == name]
    errors = [f'{e["structure"]} entered' for e in entered if e["structure"] != name]
    if sum(e["passes"] for e in mine) != passes:
        errors.append(f"{name}: {sum(e['passes'] for e in mine)} passes, not {passes}")
    deepest = max((e["depth_mm"] for e in mine), default=0)
    if abs(deepest - depth) > MM:
        errors.append(f"{name}: {deepest:.2f} mm deep, not {depth:.2f}")
    return errors


def run(brachy, folder, session, expected, model_text, is_fresh):
    motion, scene = session.write(folder, model_text)
    out = os.path.join(folder, session.name)
    if is_fresh:
        shutil.rmtree(out, ignore_errors=True)
    subprocess.run([brachy, "replay", motion, "--offline", "--config", scene, "--session", out], check=True,
                   stdout=subprocess.DEVNULL)
    with open(os.path.join(out, "report.json")) as file:
        report = json.load(file)
    said = [finding["text"] for finding in report["findings"]]
    errors = dose_errors(report, expected) + organ_errors(report, session.organ)
    if session.says is None:
        errors += [f"a finding: {text}" for text in said]
    elif not any(session.says in text for text in said[:3]):
        errors.append(f'no finding says "{session.says}"')
    print(f'{session.name:20} {"FAIL" if errors else "ok  "} {report["seeds"]["headline"]}')
    for text in said[:3]:
        print(f"    {text}")
    for text in errors:
        print(f"    FAIL: {text}")
    sys.stdout.flush()
    return not errors


def main():
    brachy, folder, *only = sys.argv[1:]
    quick, fresh = "--quick" in only, "--fresh" in only
    only = [name for name in only if not name.startswith("--")]
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(REFERENCE, "expected.json")) as file:
        expected = json.load(file)
    plan = generators.load_plan()
    good = [run(brachy, folder, generators.Session(name, plan), expected[name], QUICK if quick else "", fresh)
            for name in only or generators.SESSIONS]
    sys.exit(0 if all(good) else 1)


if __name__ == "__main__":
    main()
