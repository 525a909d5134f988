#!/usr/bin/env python3
"""Checks links and cited paths, the size of README.md, line lengths, and words that the project does not use.

  links    every relative link and anchor in Markdown, and every path of this repository that is cited in Markdown, comments
           and scripts, exists
  readme   README.md has at most 180 lines and 1,800 words
  columns  no line of C++, Python and shell is longer than 120 columns
  words    none of WORDS, below, in names, text or comments

usage: scripts/ci/check_docs.py [--only links|readme|columns|words] [PATH...]     exit code 1 and a line for each breach
PATH: directories or files to check; default: the whole repository.
"""
import argparse
import functools
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
README_LINES, README_WORDS, COLUMNS = 180, 1800, 120

CPP = {".h", ".cpp", ".in"}
SCRIPTS = {".py", ".sh", ".slurm", ".cmake", ".txt", ".toml", ".mjs", ".yml"}
WEB = {".ts", ".tsx", ".html", ".css"}
UNITS = {".service", ".conf"}
TEXT = CPP | SCRIPTS | WEB | UNITS | {".md"}
COLUMN_CHECKED = {".h", ".cpp", ".py", ".sh", ".slurm"}
SKIPPED = {"scripts/ci/check_docs.py"}  # has the words themselves


def word(stem, endings=""):
    """A pattern for a word in prose, snake_case and CamelCase: `mend` matches mend, x_mend and XMend, not recommend."""
    capital = stem[0].upper() + stem[1:]
    return rf"(?:(?<![A-Za-z]){stem}|{capital})(?:{endings})?(?![a-z])|(?<![A-Za-z]){stem.upper()}"


def phrase(text):
    """A pattern for a phrase that may be broken over lines of a comment."""
    return r"\b" + r"(?:\s|[/#*])+".join(map(re.escape, text.split())) + r"\b"


# Pattern, and what to write instead. `word` keeps ordinary English apart: the patterns for ladder, rung, room,
# house, mend, twin and suspect do not match bladder, sprung, headroom, household, recommend, amend, entwine and
# suspected.
WORDS = [
    (word("rung", "s"), "deformation model"),
    (r"(?<![bB])[Ll]adder|LADDER", "deformation models"),
    (word("room", "s"), "space, directory"),
    (word("house", "s"), "directory, module"),
    (r"\b[Aa]new\b", "again, from scratch"),
    (word("audience", "s"), "viewers, relaying"),
    (word("mend", "er|ers|ed|s|ing"), "repair"),
    (word("hygiene"), "validation"),
    (word("twin", "s"), "duplicate"),
    (word("seat", "s|ed|ing"), "reinitialize"),
    (word("reseat", "s|ed|ing"), "reinitialize"),
    (word("suspect", "s"), "candidate"),
    (word("vouch", "es|ed|ing"), "trust, certify"),
    (r"\bkeep_house\b", "on_timer"),
    (r"\btell_state\b", "broadcast_state"),
    (r"\bshow_scene\b", "set_scene"),
    (r"\bPatientStderr\b|\bpatient_stderr\b", "NonBlockingStderr"),
    (r"\bMadePage\b|\bmade_page\b", "DynamicPage"),
    (r"\bOwnViewer\b|\bown_viewer\b", "InProcessViewer"),
    (r"\bCellSearch\b|\bcell_search\b", "InjectivitySearch"),
    (r"\bgo_on_from\b", "resume_from"),
    (r"\bGate::Place\b", "ConnectionSlot"),
    (phrase("who reads"), "stalled client"),
    (phrase("who may connect"), "access control"),
    (phrase("a device in the hand"), "haptic rendering and its stability"),
    (phrase("what guards against it"), "injectivity guard"),
    (phrase("held back"), "clamped"),
    (phrase("why so"), "design rationale"),
    (phrase("to be freed of"), "released with"),
    (phrase("one of them otherwise"), "rename one of them"),
    (phrase("lets not everybody in"), "requires authentication"),
]
# Where a word has its ordinary meaning: (path pattern, matched line pattern).
ALLOWED = [
    (r"scripts/same_bits\.sh", r"^renamed = "),  # keys of old builds' reports
]

TREES = "core|net|haptics|apps|tests|scripts|config"
PATH = re.compile(rf"(?<![\w./-])((?:{TREES})/[\w./+-]*)(?![\w{{$<*…\\\[])")
BARE = re.compile(r"(?<![\w./<\"{}$*-])([A-Za-z][\w-]*\.(?:h|cpp|py|sh|md))(?![\w./*])")
# Names of files outside the repository: OpenIGTLink's documentation of the header.
FOREIGN = {"header.md"}


def files(paths):
    git = ["git", "-C", ROOT, "ls-files", "-co", "--exclude-standard"]
    listed = subprocess.run(git, capture_output=True, text=True)
    names = listed.stdout.split("\n")[:-1] if listed.returncode == 0 else \
        [str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if p.is_file() and "build" not in p.relative_to(ROOT).parts]
    wanted = [str(pathlib.Path(p).resolve().relative_to(ROOT)) for p in paths]
    inside = [n for n in names if (ROOT / n).is_file()]
    return inside, [n for n in inside if n not in SKIPPED and pathlib.Path(n).suffix in TEXT and
                    (not wanted or any(w == "." or n == w or n.startswith(w + "/") for w in wanted))]


@functools.lru_cache(None)
def read(name):
    return (ROOT / name).read_text(errors="replace")


def line_of(text, at):
    return text.count("\n", 0, at) + 1


@functools.lru_cache(None)
def anchors(name):
    found = {}
    for heading in re.findall(r"^#+ +(.*?)\s*$", re.sub(r"^```.*?^```", "", read(name), flags=re.M | re.S), re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        found[slug] = found.get(slug, -1) + 1
    return {s if not i else f"{s}-{i}" for s, n in found.items() for i in range(n + 1)}


def check_links(name, bases):
    text, suffix = read(name), pathlib.Path(name).suffix
    here = (ROOT / name).parent
    if suffix == ".md":
        for m in re.finditer(r"\]\(([^)\s]+)\)", text):
            path, _, anchor = m[1].partition("#")
            if re.match(r"[a-z]+:", path):
                continue
            target = (here / path).resolve() if path else ROOT / name
            if not target.exists():
                yield line_of(text, m.start()), f"link to {m[1]}: no such file"
            elif anchor and target.suffix == ".md" and anchor not in anchors(str(target.relative_to(ROOT))):
                yield line_of(text, m.start()), f"link to {m[1]}: no such heading"
    comments = text
    if suffix in CPP | WEB:  # code keeps its length, so that line numbers hold
        comments = re.sub(r"^((?:(?!//).)*)", lambda m: " " * len(m[1]), text, flags=re.M)
    for m in PATH.finditer(comments):
        path = m[1].rstrip("./")
        if re.search(r"/(NAME|TARGET)", path):  # a placeholder
            continue
        if not any(p.exists() for p in (ROOT / path, ROOT / f"{path}.in", here / path)):
            yield line_of(text, m.start()), f"cites {path}, which does not exist"
    if suffix in CPP | WEB | {".md"}:
        for m in BARE.finditer(comments):
            if m[1] not in bases and m[1] not in FOREIGN:
                yield line_of(text, m.start()), f"cites {m[1]}, which does not exist"


def check_words(name):
    text = read(name)
    lower = f"{name}\n{text}".lower()
    for literal, pattern, instead in COMPILED:
        if literal not in lower:
            continue
        for shown, where in ((name, None), (text, text)):
            for m in pattern.finditer(shown):
                line = line_of(text, m.start()) if where else 0
                content = text.split("\n")[line - 1] if where else name
                if not any(re.fullmatch(p, name) and re.search(c, content) for p, c in ALLOWED):
                    yield line, f"\"{' '.join(m[0].split())}\": write {instead}"


def check_columns(name):
    if pathlib.Path(name).suffix in COLUMN_CHECKED:
        for i, line in enumerate(read(name).split("\n"), 1):
            if len(line) > COLUMNS:
                yield i, f"{len(line)} columns"


def check_readme(name):
    if name == "README.md":
        text = read(name)
        if text.count("\n") > README_LINES:
            yield 1, f"{text.count(chr(10))} lines, more than {README_LINES}"
        if len(text.split()) > README_WORDS:
            yield 1, f"{len(text.split())} words, more than {README_WORDS}"


# With the longest literal of each pattern, in lower case, without which it cannot match: most files have none of them.
COMPILED = [(max(re.findall(r"[a-z]+", re.sub(r"\\.", " ", p)), key=len), re.compile(p), instead) for p, instead in WORDS]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=["links", "readme", "columns", "words"])
    parser.add_argument("paths", nargs="*")
    options = parser.parse_args()
    every, names = files(options.paths)
    bases = {pathlib.Path(n).name for n in every}
    checks = {"links": lambda n: check_links(n, bases), "readme": check_readme, "columns": check_columns,
              "words": check_words}
    counts = {}
    for kind, check in checks.items():
        if options.only in (None, kind):
            counts[kind] = 0
            for name in names:
                for line, complaint in check(name):
                    print(f"{name}:{line}: {complaint}", file=sys.stderr)
                    counts[kind] += 1
    summary = ", ".join(f"{kind} {count}" for kind, count in counts.items())
    if any(counts.values()):
        sys.exit(f"docs: {summary}")
    print(f"docs: ok, {len(names)} files")


if __name__ == "__main__":
    main()
