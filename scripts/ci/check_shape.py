#!/usr/bin/env python3
"""Checks that what a tick runs through stays small enough to change.

In core/simulation, core/models and core/needle no function is longer than 60 lines, from its first to its closing
brace, no class or struct has more than 15 data members, and simulator.cpp is not longer than 280 lines. Sources are
as clang-format writes them.

usage: scripts/ci/check_shape.py [--root DIR]     exit code 1 and a line for each
"""
import re

from complaints import end, root_of

FOLDERS = ("core/simulation", "core/models", "core/needle")
MOST_LINES, MOST_MEMBERS = 60, 15
FILES = {"core/simulation/simulator.cpp": 280}

CLASS = re.compile(r"^(?P<indent> *)(?:class|struct)(?: alignas\(\w+\))? (?P<name>\w+)[^;()]*\{$")
NO_MEMBER = re.compile(r"\s*(using|static|friend|typedef|enum|class|struct|union|public|private|protected|template"
                       r"|return|explicit|virtual|namespace|operator)\b")


def code_of(text):
    """Lines without comments and without what stands in quotes."""
    text = re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', lambda m: re.sub(r"[^\n]", "", m[0]), text, flags=re.S)
    return [line.rstrip() for line in text.split("\n")]


def functions(lines):
    """First line, from 1, and number of lines of each function that stands at the left margin."""
    first = None
    for number, line in enumerate(lines):
        if first is None and re.match(r"[A-Za-z~].*", line) and not re.match(
                r"(namespace|class|struct|enum|using|template|extern|requires|#)\b", line):
            first = number
        elif line == "}":
            if first is not None and any("(" in text for text in lines[first:number]):
                yield first + 1, number - first + 1
            first = None
        if first is not None and line.endswith(";") and not any(
                text.endswith("{") for text in lines[first:number + 1]):
            first = None  # a declaration


def flat(declaration):
    """A declaration without template arguments and initial values."""
    before = None
    while before != declaration:
        before, declaration = declaration, re.sub(r"<[^<>]*>|\{[^{}]*\}", "", declaration)
    return re.sub(r"=[^;]*?\([^()]*\)|=[^,;]*", "", declaration)


def members(lines, begin, indent):
    """How many data members the class has whose body starts after line `begin`."""
    count, statement, depth = 0, "", 0
    for line in lines[begin + 1:]:
        if line.startswith(indent + "}"):
            break
        if depth == 0 and re.fullmatch(r"\s*(public|private|protected):", line):
            continue
        statement += " " + line.strip()
        depth += line.count("{") - line.count("}")
        if depth == 0 and (line.endswith(";") or line.endswith("}")):
            declaration = flat(statement)
            is_other = NO_MEMBER.match(declaration) or re.search(r"\(|\boperator\b", declaration)
            if not is_other and declaration.strip().endswith(";"):
                count += declaration.count(",") + 1
            statement = ""
    return count


def complaints_of(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            file, lines = path.relative_to(root), code_of(path.read_text(encoding="utf-8"))
            if len(lines) - 1 > FILES.get(str(file), len(lines)):
                yield f"{file}: has {len(lines) - 1} lines, more than {FILES[str(file)]}; take a part out of it"
            for first, count in functions(lines):
                if count > MOST_LINES:
                    yield f"{file}:{first}: a function of {count} lines, more than {MOST_LINES}; take it apart"
            for number, line in enumerate(lines):
                begins = CLASS.match(line)
                count = members(lines, number, begins["indent"]) if begins else 0
                if count > MOST_MEMBERS:
                    yield (f"{file}:{number + 1}: {begins['name']} has {count} data members, more than "
                           f"{MOST_MEMBERS}; put those that belong together into structs")


def main():
    end("shape", complaints_of(root_of(__doc__)),
        f"no function over {MOST_LINES} lines and no class over {MOST_MEMBERS} members in a tick")


if __name__ == "__main__":
    main()
