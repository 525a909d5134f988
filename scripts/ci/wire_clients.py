#!/usr/bin/env python3
"""Checks that the codecs of Python and TypeScript are those that net/protocol.json makes, or writes them.

usage: scripts/ci/wire_clients.py [--write]     exit code 1 and a line for each file that differs
  --write: write apps/python/brachyd/wire_generated.py and apps/viewer/src/protocol/wire_generated.ts

Each record, section and message is a class (Python) or an interface (TypeScript) with the schema's fields; counts and
reserved fields are left out, as they follow from the rest. Sections stand under `sections`, those that are absent as
None or null; sections of unknown id are skipped. What a field means for a program is written by hand beside it: in
wire_views.py, whose class XView the generated class X extends (its `after_read` is called on what was read), and in
the other files of apps/viewer/src/protocol.
"""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from wire_constants import camel  # pylint: disable=wrong-import-position
from wire_schema import FORMATS, ROOT, SIZES, Schema, write_or_compare  # pylint: disable=wrong-import-position

PYTHON = ROOT / "apps/python/brachyd/wire_generated.py"
VIEWS = ROOT / "apps/python/brachyd/wire_views.py"
TYPESCRIPT = ROOT / "apps/viewer/src/protocol/wire_generated.ts"
INTEGERS = ("u8", "u16", "u32", "u64", "i32", "time")
ABOUT = "Written by scripts/ci/wire_clients.py from net/protocol.json, and not edited. Fields: net/PROTOCOL.md."
WIDTH = 118


class Type:
    """What becomes a class: a record, a section or a message."""

    def __init__(self, name, fields, message=None, sections=None):
        self.name, self.fields, self.message, self.sections = name, fields, message, sections or {}


def types_of(schema):
    """All, those that others use first."""
    found = [Type(camel(name), fields) for name, fields in schema.records.items() if not is_row(schema, name)]
    for name, message in schema.all["messages"].items():
        own = camel(name)
        sections = {section: (content["id"], own + camel(section))
                    for section, content in message.get("sections", {}).items()}
        found += [Type(sections[section][1], content["fields"])
                  for section, content in message.get("sections", {}).items()]
        found.append(Type(own, message["fields"], name, sections))
    names = [one.name for one in found]
    if len(set(names)) != len(names):
        sys.exit(f"wire clients: {sorted(name for name in names if names.count(name) > 1)} would be two classes each")
    return found


def is_row(schema, kind):
    """Whether a list of these records is read as rows of numbers of one type."""
    fields = schema.records.get(kind, [{}])
    return len({field.get("type") for field in fields}) == 1 and fields[0].get("type") in ("u32", "f32")


def least_bytes(schema, field):
    """What a field takes at least: no count is believed beyond what can follow."""
    kind, count = field["type"], field.get("count", 1)
    if isinstance(count, list):
        return 0
    if kind in schema.records:
        return count * sum(least_bytes(schema, inner) for inner in schema.records[kind])
    return count * {"text": 2, "sections": 4}.get(kind, SIZES.get(kind, 0))


def is_plain(field):
    """A single number."""
    return field["type"] in FORMATS and "count" not in field


def wrapped(start, items, end, indent="    ", width=WIDTH):
    """`start` items `end`, on as many lines as they need."""
    lines, line = [], indent + start
    hang = indent + " " * len(start)
    for i, item in enumerate(items):
        piece = item + (end if i == len(items) - 1 else ", ")
        if len(line) + len(piece.rstrip()) > width and line.strip() != start.strip():
            lines.append(line.rstrip())
            line = hang
        line += piece
    return lines + [line if items else line + end]


# --- Python ---

PY_HEAD = f'''"""Codecs of all messages.

{ABOUT}
"""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, Dict, List, Optional, Union

import numpy as np
import numpy.typing as npt

from . import wire_views as views
from .constants import MessageType
from .wire_bytes import Array, FloatArray, IndexArray, Reader, Writer, boolean, checked, eye, zeros
'''


class Python:
    """Writes wire_generated.py."""

    def __init__(self, schema, views):
        self.schema, self.views = schema, set(re.findall(r"^class (\w+)View\b", views, re.M))
        self.hooks = {name for name in self.views
                      if "def after_read" in re.search(rf"^class {name}View\b.*?(?=^class |\Z)", views, re.M | re.S)[0]}

    def text(self):
        found = types_of(self.schema)
        unknown = self.views - {one.name for one in found}
        if unknown:
            sys.exit(f"wire clients: {VIEWS.name} has views of no class: {sorted(unknown)}")
        flags = sorted({field["flags"] for one in found for field in one.fields if "flags" in field})
        head = PY_HEAD.replace("from .constants import MessageType\n",
                               "\n".join(wrapped("from .constants import (", ["MessageType", *flags], ")", "")) + "\n")
        parts = [head] + ["\n".join(self.type(one)) + "\n" for one in found]
        server = [one for one in found if one.message and self.schema.all["messages"][one.message]["from"] != "client"]
        names = "\n".join(wrapped("ServerMessage = Union[", [one.name for one in server], "]", ""))
        readers = "\n".join(f"    MessageType.{one.message}: {one.name}," for one in found if one.message)
        table = f"# Of each type.\nMESSAGES: Dict[int, Any] = {{\n{readers}\n}}"
        return "\n\n".join(parts + [f"{names}\n{table}\n"])

    def annotation(self, one):
        kind, count = one["type"], one.get("count")
        if "flags" in one:
            return one["flags"]
        if one.get("bool"):
            return "bool"
        if count is None:
            plain = {"text": "str", "pose": "Array", "f32": "float", "f64": "float"}
            return camel(kind) if kind in self.schema.records else "int" if kind in INTEGERS else plain[kind]
        if kind == "u8":
            return "bytes"
        if is_row(self.schema, kind):
            kind = self.schema.records[kind][0]["type"]
        arrays = {"f64": "Array", "f32": "FloatArray", "u32": "IndexArray", "text": "List[str]"}
        return arrays.get(kind) or f"List[{camel(kind)}]"

    def default(self, one):
        kind, count, given = one["type"], one.get("count"), one.get("default")
        if "flags" in one:
            return f"{one['flags']}({given or 0})"
        if given is not None:
            return {"nan": "math.nan", "inf": "math.inf"}.get(given, repr(given))
        if one.get("bool"):
            return "False"
        if count is None:
            plain = {"text": '""', "pose": "field(default_factory=eye)", "f32": "0.0", "f64": "0.0"}
            if kind in self.schema.records:
                return f"field(default_factory=lambda: {camel(kind)}())"
            return "0" if kind in INTEGERS else plain[kind]
        if kind == "u8":
            return f"bytes({count})" if isinstance(count, int) else 'b""'
        if is_row(self.schema, kind):
            return f"field(default_factory=lambda: zeros({self.dtype(kind)}, 0, {len(self.schema.records[kind])}))"
        if kind in SIZES and kind != "pose":
            shape = (count,) if isinstance(count, int) else (0, *count[1:])
            return f"field(default_factory=lambda: zeros({', '.join(map(str, (self.dtype(kind), *shape)))}))"
        return "field(default_factory=list)"

    def dtype(self, kind):
        if kind in self.schema.records:
            kind = self.schema.records[kind][0]["type"]
        return {"f64": "np.float64", "f32": "np.float32", "u32": "np.uint32"}[kind]

    def type(self, one):
        base = f"(views.{one.name}View)" if one.name in self.views else ""
        lines = self.sections_class(one) if one.sections else []
        lines += ["@dataclass", f"class {one.name}{base}:"]
        if one.message:
            lines.append(f"    TYPE: ClassVar[MessageType] = MessageType.{one.message}")
        counts, shown = self.schema.counted_by(one.fields), []
        for item in one.fields:
            if item["type"] != "sections" and item["name"] != "reserved" and item["name"] not in counts:
                shown.append(item)
                lines.append(f"    {item['name']}: {self.annotation(item)} = {self.default(item)}")
        if one.sections:
            lines.append(f"    sections: {one.name}Sections = field(default_factory=lambda: {one.name}Sections())")
        lines += ["", "    @classmethod", f"    def read(cls, r: Reader) -> {one.name}:"]
        lines += ["        " + line for line in self.reads(one)]
        made = [self.converted(item) for item in shown] + (["sections"] if one.sections else [])
        start = "made = cls(" if one.name in self.hooks else "return cls("
        lines += wrapped(start, made, ")", "        ")
        if one.name in self.hooks:
            lines += ["        made.after_read()", "        return made"]
        lines += ["", "    def write(self, w: Writer) -> None:"]
        lines += ["        " + line for line in self.writes(one)]
        if one.message:
            lines += ["", "    def encode(self) -> bytes:", "        w = Writer()", "        self.write(w)",
                      "        return bytes(w.data)"]
        return lines

    def sections_class(self, one):
        lines = ["@dataclass", f"class {one.name}Sections:"]
        lines += [f"    {section.lower()}: Optional[{name}] = None" for section, (_, name) in one.sections.items()]
        lines += ["", "    @classmethod", f"    def read(cls, r: Reader) -> {one.name}Sections:",
                  "        made = cls()", "        for number, s in r.sections():"]
        for i, (section, (number, name)) in enumerate(one.sections.items()):
            lines += [f"            {'el' if i else ''}if number == {number}:",
                      f"                made.{section.lower()} = {name}.read(s)"]
        lines += ["            else:", "                continue", "            s.finish()", "        return made", ""]
        pairs = [f"({number}, self.{section.lower()})" for section, (number, _) in one.sections.items()]
        lines.append("    def write(self, w: Writer) -> None:")
        return lines + wrapped("w.sections([", pairs, "])", "        ") + ["", ""]

    @staticmethod
    def converted(item):
        """The value of a constructor, of what was read."""
        if "flags" in item:
            return f"{item['flags']}({item['name']})"
        return f"boolean({item['name']})" if item.get("bool") else item["name"]

    def flush(self, run):
        """A statement that reads a run of numbers and reserved bytes at once."""
        names = [item["name"] for item in run if item["name"] != "reserved"]
        if not names:
            return [f"r.take({sum(self.schema.size(item) for item in run)})"]
        if len(names) == 1:
            return [f'{names[0]}, = r.get("{self.form(run)}")']
        call = f' = r.get("{self.form(run)}")'
        line = ", ".join(names) + call
        return [line] if len(line) + 8 <= WIDTH else wrapped("(", names, ")" + call, "", WIDTH - 8)

    def form(self, run):
        """The run's format for struct."""
        text = ""
        for item in run:
            code = f"{self.schema.size(item)}x" if item["name"] == "reserved" else FORMATS[item["type"]]
            last = re.search(r"(\d*)([A-Za-z])$", text)
            if last and last[2] == code and code != "x":
                text = text[:last.start()] + f"{int(last[1] or 1) + 1}{code}"
            else:
                text += code
        return text

    def reads(self, one):
        lines, run = [], []
        for item in one.fields:
            if is_plain(item) or item["name"] == "reserved":
                run.append(item)
                continue
            lines += (self.flush(run) + self.checks(one, run)) if run else []
            run = []
            lines += self.read_field(one, item)
        return lines + ((self.flush(run) + self.checks(one, run)) if run else [])

    @staticmethod
    def checks(one, items):
        return [f'checked({item["name"]}, {item.get("least", 0)}, {item.get("most", "math.inf")}, '
                f'"{one.message or one.name}", "{item["name"]}")'
                for item in items if "least" in item or "most" in item]

    def read_field(self, one, item):
        name, kind, count = item["name"], item["type"], item.get("count")
        if kind == "sections":
            return [f"sections = {one.name}Sections.read(r)" if one.sections else "r.skip_sections()"]
        if count is None:
            call = f"{camel(kind)}.read(r)" if kind in self.schema.records else f"r.{kind}()"
            return [f"{name} = {call}"]
        number = self.number(count)
        width = count[1] if isinstance(count, list) and len(count) == 2 else 0
        if kind == "u8":
            return [f"{name} = bytes(r.take({number}))"]
        if is_row(self.schema, kind):
            return [f"{name} = r.rows({self.dtype(kind)}, {number}, {len(self.schema.records[kind])})"]
        if kind in SIZES and kind != "pose":
            call = f"r.rows({self.dtype(kind)}, {number}, {width})" if width else \
                f"r.numbers({self.dtype(kind)}, {number})"
            return [f"{name} = {call}"]
        each = "r.text()" if kind == "text" else f"{camel(kind)}.read(r)"
        least = 2 if kind == "text" else sum(least_bytes(self.schema, inner) for inner in self.schema.records[kind])
        return [f"{name} = [{each} for _ in range(r.fits({number}, {least}))]"]

    @staticmethod
    def number(count):
        if isinstance(count, int):
            return str(count)
        listed, _, inner = count[0].partition(".")
        return f"int({listed}[:, 1].sum(dtype=np.uint64))" if inner else listed

    def writes(self, one):
        counts, lines, run = self.schema.counted_by(one.fields), [], []
        for item in one.fields + [None]:
            if item and (is_plain(item) or item["name"] == "reserved"):
                run.append(item)
                continue
            if run:
                values = [f"len(self.{counts[plain['name']]['name']})" if plain["name"] in counts else
                          f"self.{plain['name']}" for plain in run if plain["name"] != "reserved"]
                lines += wrapped("w.put(", [f'"{self.form(run)}"', *values], ")", "", WIDTH - 8)
                run = []
            if item:
                lines.append(self.write_field(one, item))
        return lines

    def write_field(self, one, item):
        name, kind, count = item["name"], item["type"], item.get("count")
        if kind == "sections":
            return "self.sections.write(w)" if one.sections else "w.sections([])"
        if count is None:
            return f"self.{name}.write(w)" if kind in self.schema.records else f"w.{kind}(self.{name})"
        if kind == "u8":
            return f"w.raw(self.{name}, {count})" if isinstance(count, int) else f"w.raw(self.{name})"
        if is_row(self.schema, kind) or (kind in SIZES and kind != "pose"):
            width = len(self.schema.records[kind]) if is_row(self.schema, kind) else \
                count if isinstance(count, int) else count[1] if len(count) == 2 else 1
            return f"w.array(self.{name}, {self.dtype(kind)}, {width})"
        return f"w.texts(self.{name})" if kind == "text" else f"w.each(self.{name})"


# --- TypeScript ---

TS_NAMES = {"X_WN": "pose", "X_WI": "pose"}


def lower_camel(name):
    words = camel(name)
    return TS_NAMES.get(name, words[:1].lower() + words[1:])


class TypeScript:
    """Writes wire_generated.ts."""

    def __init__(self, schema):
        self.schema = schema

    def text(self):
        found = types_of(self.schema)
        lines = [f"// Codecs of all messages, and the wire's numbers. {ABOUT}",
                 "import {ProtocolError, section, type ByteReader, type ByteWriter, type Vec3} from './bytes.js';", ""]
        for constant in self.schema.all["constants"].values():
            if "ts" in constant:
                about = f"  // {constant['about']}" if "about" in constant else ""
                lines.append(f"export const {constant['ts']} = {constant['value']};{about}")
        for kind in ("enums", "flags"):
            for enum in self.schema.all[kind].values():
                if "ts" in enum:
                    named = [f"{enum.get('ts_names', {}).get(key, camel(key))}: {value}"
                             for key, value in enum["values"].items()]
                    lines += [f"export const {enum['ts']} = {{", *wrapped("", named, ",", "  "), "} as const;"]
        for one in found:
            lines += ["", *self.interface(one), "", *self.reader(one), "", *self.writer(one)]
        return "\n".join(lines) + "\n"

    def annotation(self, item):
        kind, count = item["type"], item.get("count")
        if item.get("bool"):
            return "boolean"
        if count is None:
            if kind in self.schema.records:
                return camel(kind)
            plain = {"text": "string", "pose": "ArrayLike<number>"}
            return plain.get(kind, "bigint" if item.get("exact") else "number")
        if kind == "u8":
            return "Uint8Array"
        if kind == "f64":
            return "Vec3" if count == 3 else "[number, number][]" if isinstance(count, list) and count[1:] == [2] else \
                "number[]"
        if is_row(self.schema, kind):
            kind = self.schema.records[kind][0]["type"]
        return {"f32": "Float32Array", "u32": "Uint32Array", "text": "string[]"}.get(kind) or f"{camel(kind)}[]"

    def shown(self, one):
        counts = self.schema.counted_by(one.fields)
        return [item for item in one.fields
                if item["type"] != "sections" and item["name"] != "reserved" and item["name"] not in counts]

    def interface(self, one):
        lines = []
        if one.sections:
            lines += [f"export interface {one.name}Sections {{"]
            lines += [f"  {lower_camel(section)}: {name} | null;" for section, (_, name) in one.sections.items()]
            lines += ["}", ""]
        lines.append(f"export interface {one.name} {{")
        lines += [f"  {lower_camel(item['name'])}: {self.annotation(item)};" for item in self.shown(one)]
        if one.sections:
            lines.append(f"  sections: {one.name}Sections;")
        return lines + ["}"]

    def reader(self, one):
        lines = [f"export function read{one.name}(r: ByteReader): {one.name} {{"]
        for item in one.fields:
            lines += ["  " + line for line in self.read_field(one, item)]
        names = [lower_camel(item["name"]) for item in self.shown(one)] + (["sections"] if one.sections else [])
        if one.message:
            lines.append("  r.finish();")
        return lines + wrapped("return {", names, "};", "  ") + ["}"]

    def read_field(self, one, item):
        kind, count, name = item["type"], item.get("count"), lower_camel(item["name"])
        if item["name"] == "reserved":
            return [f"r.skip({self.schema.size(item)});"]
        if kind == "sections":
            return self.read_sections(one)
        if count is None:
            lines = [f"const {name} = {self.read_one(item)};"]
            where = f"{one.message or one.name}: {item['name']} is"
            if "most" in item:
                lines.append(f"if ({name} > {item['most']}) throw new ProtocolError('{where} above {item['most']}');")
            if "least" in item:
                lines.append(f"if ({name} < {item['least']}) throw new ProtocolError('{where} below {item['least']}');")
            return lines
        number = self.number(count)
        width = count[1] if isinstance(count, list) and len(count) == 2 else 1
        if kind == "u8":
            return [f"const {name} = r.part({number}).slice();"]
        if is_row(self.schema, kind):
            width, kind = len(self.schema.records[kind]), self.schema.records[kind][0]["type"]
        if kind in ("f32", "u32"):
            return [f"const {name} = r.{kind}Array({f'{width} * ' if width > 1 else ''}{number});"]
        if kind == "f64" and count == 3:
            return [f"const {name} = r.vec3();"]
        if kind == "f64" and width == 2:
            return [f"const {name} = r.list({number}, 16, (): [number, number] => [r.f64(), r.f64()]);"]
        least = least_bytes(self.schema, {"type": kind})
        each = f"read{camel(kind)}(r)" if kind in self.schema.records else f"r.{kind}()"
        return [f"const {name} = r.list({number}, {least}, () => {each});"]

    def read_one(self, item):
        kind = item["type"]
        if kind in self.schema.records:
            return f"read{camel(kind)}(r)"
        if item.get("bool"):
            return f"r.boolean('{item['name']}')"
        if kind in ("u64", "time"):
            return "r.u64Exact()" if item.get("exact") else "r.u64()"
        return f"r.{kind}()"

    @staticmethod
    def number(count):
        if isinstance(count, int):
            return str(count)
        listed, _, inner = count[0].partition(".")
        return f"{lower_camel(listed)}.reduce((sum, value, i) => (i % 2 ? sum + value : sum), 0)" if inner \
            else lower_camel(listed)

    def read_sections(self, one):
        if not one.sections:
            return ["r.sections(() => false);"]
        empty = [f"{lower_camel(section)}: null" for section in one.sections]
        lines = wrapped(f"const sections: {one.name}Sections = {{", empty, "};", "") + ["r.sections((id, s) => {"]
        for i, (section, (number, name)) in enumerate(one.sections.items()):
            target = f"sections.{lower_camel(section)}"
            lines.append(f"  {'else ' if i else ''}if (id === {number}) {target} = read{name}(s);")
        return lines + ["  else return false;", "  return true;", "});"]

    def writer(self, one):
        lines = [f"export function write{one.name}(w: ByteWriter, v: {one.name}): void {{"]
        counts = self.schema.counted_by(one.fields)
        lines += [f"  {self.write_field(one, item, counts)}" for item in one.fields]
        return lines + ["}"]

    def write_field(self, one, item, counts):
        kind, count, value = item["type"], item.get("count"), f"v.{lower_camel(item['name'])}"
        if item["name"] == "reserved":
            return f"w.zeros({self.schema.size(item)});"
        if kind == "sections":
            pairs = [f"section({number}, v.sections.{lower_camel(name)}, write{own})"
                     for name, (number, own) in one.sections.items()]
            return f"w.sections([{', '.join(pairs)}]);"
        if item["name"] in counts:
            listed = counts[item["name"]]
            width = len(self.schema.records[listed["type"]]) if is_row(self.schema, listed["type"]) else \
                listed["count"][1] if len(listed["count"]) == 2 and listed["type"] in ("f32", "u32") else 1
            length = f"v.{lower_camel(listed['name'])}.length{f' / {width}' if width > 1 else ''}"
            return f"w.{kind}({f'BigInt({length})' if kind == 'u64' else length});"
        if count is None:
            if kind in self.schema.records:
                return f"write{camel(kind)}(w, {value});"
            if item.get("bool"):
                return f"w.u8(Number({value}));"
            if kind in ("u64", "time"):
                return f"w.u64({value if item.get('exact') else f'BigInt({value})'});"
            return f"w.{kind}({value});"
        if kind == "u8":
            return f"w.raw({value});"
        if is_row(self.schema, kind) or kind in ("f32", "u32"):
            return f"w.array({value});"
        if kind == "f64" and isinstance(count, list) and count[1:] == [2]:
            return f"for (const [x, y] of {value}) {{ w.f64(x); w.f64(y); }}"
        each = f"write{camel(kind)}(w, one)" if kind in self.schema.records else f"w.{kind}(one)"
        return f"for (const one of {value}) {each};"


def main():
    schema = Schema()
    files = {PYTHON: Python(schema, VIEWS.read_text(encoding="utf-8")).text(), TYPESCRIPT: TypeScript(schema).text()}
    found = write_or_compare(files, "--write" in sys.argv[1:], "wire_clients.py")
    for line in found:
        print(line)
    print(f"wire clients: {len(found)} differences")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
