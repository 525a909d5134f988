#!/usr/bin/env python3
"""Changes needle, wire, dose and planning by one small error at a time, and shows which the quick tests catch.

A seeded draw takes as many errors of each area: a sign turned, a comparison or an index off by one, a constant ten
times as large, a check left out. Each is made in a worktree of its own (out/mutants), never in yours; one that does
not compile is drawn again. The tests of the same folder run first, then all with the label `quick`.

usage: scripts/campaigns/mutants.py [--seed N] [--count N] [--only AREA] [--skip N] [--json FILE]
exit code 0: all were caught; 1: some lived, which are printed. Half an hour for forty on two idle cores.
"""
import argparse
import json
import pathlib
import random
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TREE = ROOT / "out/mutants"
BUILD = TREE / "build/release"
AREAS = {"needle": ["core/needle"], "wire": ["net/wire"], "dose": ["core/brachytherapy/dose"],
         "planning": ["core/brachytherapy/plan"]}
PROGRAMS = ["core_tests", "input_tests", "models_tests", "realtime_tests", "haptics_tests", "net_tests"]
HANGS_S = 900

NO_CODE = re.compile(r"^\s*(//|#|using |namespace |template|static_assert|struct |class |enum |friend )|operator|\"")
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d+(?:e-?\d+)?|\d+e-?\d+)(?![\w.])")


def without_check(line):
    """The line with `if (…) return/continue/throw` never true; None: there is no such check."""
    start = re.search(r"\bif \(", line)
    if not start or not re.search(r"\) (return|continue|break|throw)\b", line):
        return None
    depth, at = 0, start.end() - 1
    for at in range(start.end() - 1, len(line)):
        depth += {"(": 1, ")": -1}.get(line[at], 0)
        if depth == 0:
            return line[:start.end() - 1] + "(false)" + line[at + 1:]
    return None


def changes(line):
    """(kind, changed line) of everything that may go wrong in a line of code."""
    code = line.split("//")[0]
    tail = line[len(code):]

    def at(match, text):
        return code[:match.start()] + text + code[match.end():] + tail

    for m in re.finditer(r"(?<=[\w)\]]) ([+-]) (?=[\w(])", code):
        yield "sign", at(m, " - " if m[1] == "+" else " + ")
    for m in re.finditer(r" ([+-])= ", code):
        yield "sign", at(m, " -= " if m[1] == "+" else " += ")
    for m in re.finditer(r"(?<=[\w)\]]) ([<>])(=?) (?=[\w(-])", code):
        yield "off by one", at(m, f" {m[1]}{'' if m[2] else '='} ")
    for m in re.finditer(r" [+-] 1\b(?![.\w])", code):
        yield "off by one", at(m, "")
    for m in NUMBER.finditer(code):
        yield "unit", at(m, f"(10 * {m[1]})")
    if changed := without_check(code):
        yield "missing check", changed + tail


def sites(folders):
    """All errors of an area, by their kind: {kind: [(file, line number, line, changed line)]}."""
    found = {}
    for folder in folders:
        for file in sorted((TREE / folder).rglob("*")):
            if file.suffix not in (".h", ".cpp"):
                continue
            for number, line in enumerate(file.read_text().split("\n")):
                if NO_CODE.search(line):
                    continue
                for kind, changed in changes(line):
                    found.setdefault(kind, []).append((str(file.relative_to(TREE)), number, line, changed))
    return found


def drawn(count, seed):
    """`count` errors, as many of each area, without end where some do not compile: [(area, draws)]."""
    each = {}
    for index, (area, folders) in enumerate(AREAS.items()):
        order = random.Random(seed * 100 + index)
        found = sites(folders)
        kinds = sorted(found)
        draws = []
        for k in range(4 * count):
            kind = kinds[k % len(kinds)]
            if found[kind]:
                draws.append((kind, *found[kind].pop(order.randrange(len(found[kind])))))
        each[area] = draws
    return each


def run(*words, timeout=None):
    try:
        return subprocess.run(words, cwd=TREE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=timeout)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(words, 124, "", "")


def prepare():
    subprocess.run(["git", "worktree", "remove", "--force", TREE], cwd=ROOT, stderr=subprocess.DEVNULL)
    subprocess.run(["git", "worktree", "prune"], cwd=ROOT, check=True)
    subprocess.run(["git", "worktree", "add", "--detach", TREE, "HEAD"], cwd=ROOT, check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    subprocess.run(["cmake", "--preset", "release"], cwd=TREE, check=True, stdout=subprocess.DEVNULL)
    if (made := build()).returncode:
        sys.exit(made.stdout[-3000:])


def build():
    return run("ninja", "-C", str(BUILD), *PROGRAMS)


def suites_beside(file):
    """The names of the suites in the folder of the tests that mirrors the file's."""
    names = set()
    for test in (TREE / "tests" / file).parent.glob("*_test.cpp"):
        names.update(re.findall(r"^TEST(?:_[FP])?\((\w+)", test.read_text(), re.M))
    return sorted(names)


def failed(output):
    """The first test that failed, of ctest's output or GoogleTest's."""
    found = (re.search(r"\[  FAILED  \] ([\w/.]+)", output) or
             re.search(r"Test +#\d+: (\S+) \.+\**(?:Failed|Timeout)", output))
    return found[1] if found else "(a crash or a hang)"


def run_quick(*options):
    return run("ctest", "--test-dir", str(BUILD), "-j", "2", "--stop-on-failure", "--output-on-failure", "-L", "quick",
               *options, timeout=HANGS_S)


def judge(file):
    """Which test catches the present error; None: it lives."""
    if (TREE / "tests" / file).parent.is_dir() and (names := suites_beside(file)):
        pattern = r"(^|/|_)(" + "|".join(names) + ")(/|$)"
        near = run_quick("-R", pattern)
        if near.returncode:
            return failed(near.stdout)
    rest = run_quick()
    return failed(rest.stdout) if rest.returncode else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=40)
    parser.add_argument("--count", type=int, default=40, help="of errors, all areas together (40)")
    parser.add_argument("--only", choices=AREAS, help="one area")
    parser.add_argument("--skip", type=int, default=0, help="of each area's errors, that were looked at before")
    parser.add_argument("--json", type=pathlib.Path, help="writes what is printed there too")
    options = parser.parse_args()

    prepare()
    results = []
    for area, draws in drawn(options.count, options.seed).items():
        if options.only and area != options.only:
            continue
        done = 0
        for kind, file, number, line, changed in draws:
            if done >= options.count // len(AREAS):
                break
            path = TREE / file
            text = path.read_text()
            lines = text.split("\n")
            lines[number] = changed
            path.write_text("\n".join(lines))
            try:
                if build().returncode:
                    continue
                done += 1
                if done <= options.skip:
                    continue
                caught = judge(file)
            finally:
                path.write_text(text)
            results.append({"area": area, "kind": kind, "file": file, "line": number + 1, "was": line.strip(),
                            "is": changed.strip(), "caught_by": caught})
            print(f"{len(results):3d} {area:9s} {kind:13s} {file}:{number + 1}: {caught or 'LIVED'}\n"
                  f"      {line.strip()}\n      {changed.strip()}", flush=True)
    lived = [r for r in results if not r["caught_by"]]
    print(f"mutants: {len(results) - len(lived)} of {len(results)} were caught by quick tests")
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")
    subprocess.run(["git", "worktree", "remove", "--force", TREE], cwd=ROOT, check=True)
    return 1 if lived else 0


if __name__ == "__main__":
    sys.exit(main())
