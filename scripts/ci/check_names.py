#!/usr/bin/env python3
"""Checks names against .clang-tidy (readability-identifier-naming) in every header and source of core, haptics, net,
apps and tests; and that no two files of a program define a class of the same name.

A source takes clang-tidy seconds, most of them for the headers of Eigen, Asio and JSON. So hundreds of sources are
included into one file, and that is parsed once. Sources whose local names clash go into different files. Which do is
guessed from the text: sources that do not parse together are parsed again by tens, at last each alone.

usage: scripts/ci/check_names.py [--jobs N] [FILE…]     exit code 1 and a line for each name that breaks the rules
"""
import argparse
import collections
import concurrent.futures
import functools
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/tidy"
TREES = ("core", "haptics", "net", "apps", "tests")
MOST_TOGETHER = 250  # sources; clang-tidy then takes two gigabytes
FEW_TOGETHER = 10  # of those that did not parse with others: one that clashes takes few with it
MESSAGE = re.compile(r"^(/[^\s:]+)(:\d+:\d+: error: .*) \[([a-z-]+).*\]$", re.M)
# At the end of each file that is parsed. If clang-tidy does not find it, the check has failed.
WRONG_NAME = "int WrongName = 0;"
# After it. After a fatal error clang instantiates no template, which takes half of the time: their names were seen.
NO_MORE = "no more templates"


def configure():
    """The directories and macros of all targets together, and the sources that some target has."""
    # Without precompiled headers, which are GCC's; each source by itself.
    subprocess.run(["cmake", "--preset", "release", "-B", BUILD, "-DBRACHY_PCH=OFF", "-DBRACHY_TOGETHER=0"], cwd=ROOT,
                   check=True, stdout=subprocess.DEVNULL)
    options, compiled = {}, set()
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        compiled.add(os.path.relpath(entry["file"], ROOT))
        words = shlex.split(entry["command"])
        for word, after in zip(words, words[1:]):
            if word.startswith(("-D", "-I")):
                options[word] = None
            elif word == "-isystem":
                options[word + after] = None
    return list(options), compiled


def is_source(file):
    return file.endswith(".cpp")


@functools.cache
def text_of(file):
    return (ROOT / file).read_text()


@functools.cache
def declared(file):
    """A guess of what a header declares at its outermost level, or a source in its unnamed namespace."""
    names = set()
    is_wanted = not is_source(file)
    for line in text_of(file).splitlines():
        if is_source(file) and line in ("namespace {", "}  // namespace"):
            is_wanted = line == "namespace {"
        if not is_wanted or re.match(r"namespace|using|TEST|INSTANTIATE|[^a-zA-Z]|$", line):
            continue
        line = re.sub(r"^template <.*?> *", "", line)
        if found := re.match(r"(?:struct|class|enum class|enum) (\w+)", line):
            names.add(found[1])
        elif line.startswith(("constexpr ", "const ", "inline const")):
            names.update(re.findall(r"\b(k[A-Z]\w*)(?:\[.*?\])*(?: =|\{|;)", line))
        elif found := re.match(r"[^({=]*(?<!::)\b(\w+)(?:\((.*)|;| =)", line):
            # With the classes of its parameters: overloads by these do not clash.
            names.add(" ".join([found[1], *re.findall(r"(?<!:)\b[A-Z]\w+(?=&)", found[2] or "")]))
    return names


@functools.cache
def included(file):
    """The project's headers that a file includes, and those that they include."""
    headers, left = set(), [file]
    while left:
        left = [path for from_file in left for path in re.findall(r'^#include "(.*)"', text_of(from_file), re.M)
                if path not in headers and (ROOT / path).exists()]
        headers.update(left)
    return headers


@functools.cache
def declared_around(file):
    """What the headers of a source declare."""
    return set().union(*(declared(header) for header in included(file)))


def namespaces_used(file):
    """Those that make names in the sources that follow ambiguous."""
    return set(re.findall(r"^using namespace (?!brachy;|test;|brachy::test;|std)(.*);", text_of(file), re.M))


class Group:
    """Files that are parsed together: no two sources declare the same, nor does a source what another's header does."""

    def __init__(self, used):
        self.files, self.names, self.around, self.used = [], set(), set(), used

    def takes(self, file, most):
        return (len(self.files) < most and self.used == namespaces_used(file)
                and not declared(file) & (self.names | self.around) and not declared_around(file) & self.names)

    def add(self, file):
        self.files.append(file)
        self.names |= declared(file)
        self.around |= declared_around(file)


def defined_twice(files):
    """Classes of the same name and namespace in two files: of their inline functions the linker keeps one's."""
    scope = re.compile(r"namespace ([\w:]*)\s*\{|(?:enum class|class|struct) (\w+)(?: final)?(?:\s*:[^:;{][^;{]*)?\s*\{"
                       r"|\{|\}")
    no_code = re.compile(r"""//.*|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])'""")
    places = {}
    for file in files:
        scopes = []  # of the namespace's name, "" where it has none; None: no namespace
        for found in scope.finditer(no_code.sub("", text_of(file))):
            if found[0] == "}":
                scopes = scopes[:-1]
                continue
            if found[2] and all(scopes):
                places.setdefault("::".join([*scopes, found[2]]), set()).add(file)
            scopes.append(found[1] if found[0].startswith("namespace") else None)
    return {f"{name} is defined in {' and '.join(sorted(where))}" for name, where in places.items() if len(where) > 1}


def group(sources, most):
    # Those whose names many declare come first, while there are groups without them.
    count = collections.Counter(name for source in sources for name in declared(source))
    groups = []
    for source in sorted(sources, key=lambda source: -max((count[name] for name in declared(source)), default=0)):
        chosen = next((g for g in groups if g.takes(source, most)), None)
        if not chosen:
            groups.append(chosen := Group(namespaces_used(source)))
        chosen.add(source)
    return [g.files for g in groups]


def parse(name, files, options):
    """The names that break the rules; what else is wrong; and the files with which that is."""
    lines = {}
    if len(files) > 1:  # what they include comes first: then it is a source that clashes, not a header
        for file in files:
            for header in re.findall(r'^#include (["<][^">]*[">])', text_of(file), re.M):
                lines[f"#if __has_include({header})\n#include {header}\n#endif"] = None
    lines = ["#define ZLIB_CONST", *lines]
    for i, file in enumerate(files):  # programs have the same entry point
        lines += [f"#define main main_{i}", f"#define LLVMFuzzerTestOneInput fuzz_{i}", f'#include "{file}"']
    together = BUILD / "names" / f"{name}.cpp"
    together.write_text("\n".join([*lines, WRONG_NAME, f'#include "{NO_MORE}"']) + "\n")
    run = subprocess.run(
        ["clang-tidy-14", "--quiet", "--checks=-*,readability-identifier-naming",
         f"--header-filter=^{re.escape(str(ROOT))}/({'|'.join(TREES)})/", together, "--", "-std=c++20", *options, "-w",
         "-ferror-limit=0"], cwd=ROOT, capture_output=True, text=True)
    names, errors, broken = [], set(), set()
    for message in re.split(r"^(?=\S+: (?:error|warning): )", run.stdout, flags=re.M):
        found = MESSAGE.match(message)
        if not found or NO_MORE in found[2]:
            continue
        file = os.path.relpath(found[1], ROOT)
        if found[3] == "readability-identifier-naming":
            names.append((file, file + found[2]))
        else:
            errors.add(file + found[2])
            # The source where it is; of an error in a header, the one that a note names; else it may be any.
            places = (os.path.relpath(p, ROOT) for p in re.findall(r"^(/[^\s:]+):\d+:\d+: ", message, re.M))
            broken.update([place for place in places if place in files][:1] or files)
    if not any(file.startswith("build/") and "'WrongName'" in text for file, text in names):
        sys.exit(f"names: clang-tidy-14 has not checked {together}:\n{run.stdout[-2000:]}{run.stderr[-2000:]}")
    # What clang makes of a broken source is not reported: it is parsed again. Nor what it makes there of a header that
    # is in another group: after an error types are unknown, and with them what a private member is.
    again = broken if len(files) > 1 else set()
    told = {text for file, text in names
            if file.startswith(TREES) and file not in again and (file in files or not broken)}
    return told, errors, broken


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("files", nargs="*")
    args = parser.parse_args()
    if not shutil.which("clang-tidy-14"):
        sys.exit("names: apt-get install clang-tidy-14")
    options, compiled = configure()
    files = args.files or subprocess.run(
        ["git", "ls-files"] + [f"{tree}/*.{end}" for tree in TREES for end in ("h", "cpp")], cwd=ROOT,
        capture_output=True, text=True, check=True).stdout.split()
    # Fuzz targets belong to the preset asan, tests/package to a build of its own.
    skipped = [file for file in files if is_source(file) and file not in compiled
               and not file.startswith(("tests/fuzz/", "tests/apps/lab/fuzz/", "tests/package/"))]
    if skipped:
        print("names: not checked, because what they need is not installed:", *skipped)
    files = [file for file in files if file not in skipped]
    shutil.rmtree(BUILD / "names", ignore_errors=True)
    (BUILD / "names").mkdir()

    breaches, unparsed = defined_twice([f for f in files if not f.startswith("tests/")]), set()
    # A model checker's header redefines keywords: what includes it is parsed alone.
    alone = [file for file in files if "<relacy/" in (ROOT / file).read_text()]
    headers = [file for file in files if not is_source(file)]
    sources = [file for file in files if is_source(file) and file not in alone]
    groups = [headers, *group(sources, MOST_TOGETHER)] + [[file] for file in alone]
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for turn in ("first", "second", "alone"):
            jobs = [pool.submit(parse, f"{turn}-{i}", together, options) for i, together in enumerate(groups)]
            again = set()
            for together, job in zip(groups, jobs):
                names, errors, broken = job.result()
                breaches |= names
                if len(together) > 1:
                    again |= broken
                else:
                    unparsed |= errors
            if turn == "first":
                groups = group(sorted(again), FEW_TOGETHER)
            else:
                groups = [[file] for file in sorted(again)]
    for line in sorted(breaches | unparsed):
        print(f"names: {line}")
    if breaches or unparsed:
        sys.exit(1)
    print(f"names: ok, {len(files)} files")


main()
