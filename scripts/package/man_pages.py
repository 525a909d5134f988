#!/usr/bin/python3
"""Writes the manuals of programs, brachyd(1), brachy(1) and brachy-study(1), gzipped, from their --help.

usage: man_pages.py VERSION DIR PROGRAM…
"""
import gzip
import pathlib
import re
import subprocess
import sys

HEAD = re.compile(  # of an option: its names, its value, what it goes with
    r"(?P<names>(?:-\w,)?--[\w-]+|[a-z]\w*)"
    r"(?P<value> (?:TEXT|INT|UINT|FLOAT)(?P<check>:\S+(?: in \[[^]]*\])?)?(?P<default>=\S+)?(?: x \d+| \.\.\.)?)?"
    r"(?P<required> REQUIRED)?(?P<with>(?: (?:Needs|Excludes):(?: --[\w-]+)+)*)"
)
COMMAND = re.compile(r"  ([a-z][\w-]*) +(\S.*)")
FILES = {
    "brachyd": """.TP
.I /etc/brachyd/scene.toml
The scene that the service runs: tissue, model, needles, seeds, server. Every key with its unit and meaning is in it.
.TP
.I /usr/share/brachy
Other scenes, trajectories and a plan; the viewer's page.
.TP
.I /usr/share/doc/brachyd/PROTOCOL.md.gz
The protocol, enough to write a client.
.TP
.I /var/lib/brachyd
The service's working folder: sessions.""",
    "brachy": """.TP
.I /usr/share/brachy
Scenes, trajectories and a plan.""",
    "brachy-study": """.TP
.I /usr/share/brachy/reference
Reference scenes of
.BR "brachy compare" .""",
}
# What brachy says of a command that is a program of its own, and that this build lacks.
ELSEWHERE = re.compile(r"install the package (brachyd-\w+)")
SEE_ALSO = {"brachyd": "brachy", "brachy": "brachyd", "brachy-study": "brachy"}


def roff(text):
    """Text as it stands: nothing in it is a request or an escape."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("…", "...")
    return "\n".join("\\&" + line if line.startswith((".", "'")) else line for line in text.split("\n"))


def option(head, description):
    match = HEAD.fullmatch(head)
    if not match:
        sys.exit(f"man_pages: not understood: {head!r}")
    names = ", ".join(f"\\fB{roff(name)}\\fR" for name in match["names"].split(","))
    kind = (match["value"] or "").split(":")[0].split("=")[0].strip()
    check = (match["check"] or "").lstrip(":").removeprefix(kind).removeprefix(" in ")
    if check.startswith("["):
        check = check.strip("[]").replace(" - ", " to ")
    check = check.strip("{}").replace(",", ", ")
    if match["with"]:  # "Needs: --a --b" as a sentence
        description += "".join(
            f"; {word.lower()} {', '.join(names.split())}"
            for word, names in re.findall(r"(Needs|Excludes):((?: --[\w-]+)+)", match["with"])
        )
    said = [
        part
        for part in (
            "required" if match["required"] else "",
            check,
            f"default {match['default'][1:]}" if match["default"] else "",
        )
        if part
    ]
    if said:
        description += f" ({'; '.join(said)})"
    return f".TP\n{names}{f' {chr(92)}fI{kind}{chr(92)}fR' if kind else ''}\n{roff(description)}"


def options(lines):
    """Blocks of a head at column 2 and a description from column 30 on, beside it or below."""
    blocks = []
    for line in lines:
        if line.startswith(" " * 29):
            blocks[-1][1].append(line.strip())
        else:
            match = HEAD.match(line, 2)
            blocks.append([match[0] if match else line.strip(), [line[match.end() :].strip()] if match else []])
    return [option(head, " ".join(part for part in parts if part)) for head, parts in blocks if head != "-h,--help"]


def parts_of(text):
    """--help in pieces: what the program is, its usage, its lists by name, and the rest."""
    about, rest = text.split("\nUsage: ", 1)
    usage, rest = rest.split("\n", 1)
    lists, footer, current = {}, [], None
    for line in rest.split("\n"):
        if line in ("Positionals:", "Options:", "Subcommands:") and not footer:
            current = lists.setdefault(line[:-1], [])
        elif line.startswith("  ") and current is not None:
            current.append(line)
        elif line or footer:
            current = None
            footer.append(line)
    return about.strip(), usage, lists, footer


def footer_of(lines):
    """Examples keep their columns; exit codes and other sentences are text."""
    out, verbatim = [], False
    for line in lines:
        indented = line.startswith("  ")
        if indented != verbatim:
            out.append(".nf" if indented else ".fi")
            verbatim = indented
        out.append(".PP" if not line else roff(line.rstrip()))
        if line.endswith(":") and not indented:
            out.append(".PP")
    if verbatim:
        out.append(".fi")
    return out


def help_of(*command):
    return subprocess.run([*command, "--help"], check=True, capture_output=True, text=True).stdout


def options_of(lists):
    return options(lists.get("Positionals", [])) + options(lists.get("Options", []))


def page(program, binary, version):
    about, usage, lists, footer = parts_of(help_of(binary))
    summary = about.rstrip(".")
    out = [
        f'.TH {program.upper()} 1 "" "brachyd {version}" "User Commands"',
        ".ad l",
        ".SH NAME",
        f"{program} \\- {roff(summary[0].lower() + summary[1:])}",
        ".SH SYNOPSIS",
        f"\\fB{program}\\fR {roff(usage[len(program):].strip())}",
        ".SH DESCRIPTION",
        roff(about),
        "For research and training. Not a medical device.",
        ".SH OPTIONS",
        *options_of(lists),
    ]
    commands = [COMMAND.fullmatch(line).groups() for line in lists.get("Subcommands", [])]
    if commands:
        out.append(".SH COMMANDS")
    for name, summary in commands:
        try:
            text = help_of(binary, name)
        except subprocess.CalledProcessError as error:
            package = ELSEWHERE.search(error.stderr)
            if not package:
                raise
            out += [f'.SS "{program} {name}"', roff(summary), f"It is in the package {package[1]}."]
            continue
        about, usage, lists, its_footer = parts_of(text)
        out += [f'.SS "{roff(usage)}"', roff(about), *options_of(lists), ".PP", *footer_of(its_footer)]
    if "Examples:" in footer:
        out += [".SH EXAMPLES AND EXIT STATUS", *footer_of(footer)]
    else:
        out += [".SH EXIT STATUS", "0 done, 1 failed while running, 2 bad input or usage, 3 refused."]
    out += [".SH FILES", FILES[program], ".SH SEE ALSO", f".BR {SEE_ALSO[program]} (1)"]
    return "\n".join(out) + "\n"


def main(version, folder, *programs):
    for binary in programs:
        program = pathlib.Path(binary).name
        text = page(program, binary, version).encode()
        (pathlib.Path(folder) / f"{program}.1.gz").write_bytes(gzip.compress(text, 9, mtime=0))


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
