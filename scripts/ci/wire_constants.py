#!/usr/bin/env python3
"""Checks C++ against net/protocol.json, and writes Python's numbers; TypeScript's: wire_clients.py.

In C++: the wire's numbers, who sends which message, and that a server handles every message that clients send.

usage: scripts/ci/wire_constants.py [--write]     exit code 1 and a line for each difference
  --write: write apps/python/brachyd/constants.py; otherwise it is checked, too
"""
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from wire_schema import ROOT, write_or_compare  # pylint: disable=wrong-import-position

CPP = ROOT / "net/wire/messages.h"
REQUESTS, SESSION = ROOT / "net/requests/requests.cpp", ROOT / "net/session/session.cpp"
PYTHON = ROOT / "apps/python/brachyd/constants.py"


def number(text):
    """The value of 0x59435242, 32, 1u << 3 or 1 << 3; None for anything else."""
    text = re.sub(r"(?<=[0-9a-fA-F])[uU]\b", "", text.strip())
    match = re.fullmatch(r"(0x[0-9a-fA-F]+|\d+)(?:\s*<<\s*(\d+))?", text)
    return int(match[1], 0) << int(match[2] or 0) if match else None


def camel(name):
    return "".join(part.capitalize() for part in name.split("_"))


def cpp_enums(text):
    """Name → {enumerator: value} of each enumeration."""
    enums = {}
    for name, body in re.findall(r"enum (?:class )?(\w+) : [\w:]+ \{(.*?)\};", text, re.S):
        body = re.sub(r"//.*", "", body)
        enums[name] = {key: number(value) for key, value in re.findall(r"(\w+) = ([^,}]+)", body)}
    return enums


def differences(schema):
    cpp_text = CPP.read_text(encoding="utf-8")
    cpp, found = cpp_enums(cpp_text), []
    for name, constant in schema["constants"].items():
        match = re.search(rf"\b{constant['cpp']} = ([^;]+);", cpp_text)
        value = number(match[1]) if match else None
        if value != constant["value"]:
            found.append(f"cpp: {constant['cpp']} is {value}, {name} is {constant['value']}")
    for kind in ("enums", "flags"):
        for name, enum in schema[kind].items():
            if "cpp" not in enum:  # C++ has these bits inside its codecs
                continue
            prefix = enum.get("cpp_prefix", "k")
            expected = {prefix + camel(key): value for key, value in enum["values"].items()}
            if cpp.get(enum["cpp"]) != expected:
                found.append(f"cpp: {enum['cpp']} is {cpp.get(enum['cpp'])}, not {expected}")
    return found


def part(path, begin, end):
    """The message types that are named between two marks of a file, as the schema names them."""
    found = re.search(re.escape(begin) + "(.*?)" + re.escape(end), path.read_text(encoding="utf-8"), re.S)
    names = re.findall(r"MessageType::k(\w+)", found[1]) if found else []
    return {re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).upper() for name in names}


def direction_differences(schema):
    senders = {name: message["from"] for name, message in schema["messages"].items()}
    end = "\n}\n"
    cpp = {"only_servers_send": (part(CPP, "bool only_servers_send(", end), ("server",)),
           "only_clients_send": (part(CPP, "bool only_clients_send(", end), ("client",)),
           "Session::handle with net/requests/requests.cpp": (
               part(REQUESTS, "kRequests[] = {", "\n};\n") | part(SESSION, "switch (type) {", end), ("client", "both"))}
    for where, (names, wanted) in cpp.items():
        expected = {name for name, sender in senders.items() if sender in wanted}
        if names != expected:
            yield f"cpp: {where} has {sorted(names - expected)} too many and lacks {sorted(expected - names)}"


def python_text(schema):
    about = "Numbers of the wire: net/PROTOCOL.md. Written by scripts/ci/wire_constants.py from net/protocol.json."
    lines = [f'"""{about}"""', "from enum import IntEnum, IntFlag", ""]
    for name, constant in schema["constants"].items():
        about = f"  # {constant['about']}" if "about" in constant else ""
        lines.append(f"{name} = {constant['value']}{about}")
    for kind, base in (("enums", "IntEnum"), ("flags", "IntFlag")):
        for name, enum in schema[kind].items():
            lines += ["", "", f"class {name}({base}):"]
            lines += [f"    {key} = {value}" for key, value in enum["values"].items()]
    return "\n".join(lines) + "\n"


def main():
    schema = json.loads((ROOT / "net/protocol.json").read_text(encoding="utf-8"))
    found = differences(schema) + list(direction_differences(schema))
    found += write_or_compare({PYTHON: python_text(schema)}, "--write" in sys.argv[1:], "wire_constants.py")
    for line in found:
        print(line)
    print(f"wire constants: {len(found)} differences")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
