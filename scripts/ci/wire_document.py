#!/usr/bin/env python3
"""Checks that the tables of fields and the golden bytes of net/PROTOCOL.md are those of net/protocol.json.

usage: scripts/ci/wire_document.py [--write]     exit code 1 and a line for each difference
  --write: write them. A table stands between `<!-- table: NAME -->` and `<!-- end -->`, NAME being header, a record, a
  message or MESSAGE.SECTION; golden bytes of the schema's examples stand in blocks fenced as ```hex NAME.
"""
import pathlib
import re
import struct
import sys
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from wire_schema import SIZES, Schema, WireError, grouped  # pylint: disable=wrong-import-position

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = ROOT / "net/PROTOCOL.md"


# --- tables ---

def symbols(fields):
    return {field["name"]: field["symbol"] for field in fields if "symbol" in field}


def times(count, letters):
    """How many, for people: "3 × ", "3T × ", "point_count × 3 × "."""
    if isinstance(count, int):
        return f"{count} × "
    name, *factor = count
    if "." in name:
        return ""
    if name in letters:
        return f"{''.join(map(str, factor))}{letters[name]} × "
    return "".join(f"{part} × " for part in (name, *factor))


def shown_type(schema, field, letters, is_inline=False):
    kind, count = field["type"], field.get("count")
    unit = (" " if is_inline else ", ") + field["unit"] if "unit" in field else ""
    if kind == "sections":
        return ""
    if kind == "u8" and isinstance(count, int):
        return f"{count} bytes"
    if kind not in schema.records:
        return ("" if count is None else times(count, letters)) + kind + unit
    if count is None:
        return kind
    record = schema.all["records"][kind]
    if record.get("inline"):
        inside = [inner["name"] if inner["name"] == inner["type"] else
                  f"{inner['name']} {shown_type(schema, inner, {}, True)}" for inner in record["fields"]]
        return f"{times(count, letters)}{{{', '.join(inside)}}}"
    size = schema.size_of(record["fields"])
    return times(count, letters) + (f"{size} B" if size else "record")


class Place:
    """Where the next field stands: bytes, and at most one term of a varying count."""

    def __init__(self):
        self.bytes, self.term, self.is_known, self.is_behind_varying = 0, "", True, False

    def __str__(self):
        if not self.is_known:
            return "…" if self.is_behind_varying else ""
        return f"{self.bytes} + {self.term}" if self.term else str(self.bytes)

    def pass_by(self, schema, field, letters):
        size, count = schema.size(field), field.get("count")
        self.is_behind_varying = size is None
        if size is not None:
            self.bytes += size
        elif self.is_known and not self.term and isinstance(count, list) and count[0] in letters:
            self.term = f"{SIZES[field['type']] * (count[1] if len(count) > 1 else 1)}{letters[count[0]]}"
        else:
            self.is_known = False


def table(schema, fields):
    flat = [inner for field in fields for inner in (schema.records[field["type"]] if field.get("spread") else [field])]
    letters, place = symbols(flat), Place()
    lines = ["| offset | field | type | meaning |", "|---|---|---|---|"]
    for field in flat:
        cells = (str(place), field["name"], shown_type(schema, field, letters), field.get("note", ""))
        lines.append("|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|")
        place.pass_by(schema, field, letters)
    return lines


def fields_of(schema, name):
    if name == "header":
        return schema.all["header"]["fields"]
    if name in schema.records:
        return schema.records[name]
    message, _, section = name.partition(".")
    content = schema.all["messages"][message]
    return content["sections"][section]["fields"] if section else content["fields"]


def table_names(schema):
    """Those that the document has to have: of all fields but a record's that is shown where it is used."""
    names = ["header"] + [name for name, record in schema.all["records"].items() if record.get("table", True) and
                          not record.get("inline")]
    return set(names) | set(schema.all["messages"]) | {
        f"{message}.{section}" for message, content in schema.all["messages"].items()
        for section, inside in content.get("sections", {}).items() if inside.get("table", True)}


# --- golden bytes ---

def meaning(schema, fields, label, value):
    """A line's comment: the field, its value, and the name of that where it has one."""
    if value is None:
        return label
    field = next((field for field in fields if field["name"] == label.strip()), {})
    words = ""
    if "enum" in field:
        values = schema.all["enums"][field["enum"]]["values"]
        words = next((f" {key}" for key, number in values.items() if number == value), "")
    elif "flags" in field:
        names = [key for key, bit in schema.all["flags"][field["flags"]]["values"].items() if value & bit]
        words = " " + " | ".join(names) if names else ""
    return f"{label}: {value}{words}"


def hex_lines(rows):
    """(bytes, comment) → lines with their comments below each other."""
    width = max(len(data) for data, _ in rows) * 3 - 1
    return [f"{data.hex(' '):{width}}  # {comment}" if comment else data.hex(" ") for data, comment in rows]


def golden_rows(schema, example):
    message = example["message"]
    body, sections = example["body"], example.get("sections")
    pieces = schema.message_pieces(message, body, sections, example["sequence"], example["stamp_ns"])
    rows, fields, header_bytes = [], schema.all["header"]["fields"], 0
    for label, value, data, width in pieces:
        if header_bytes >= 32:
            fields = schema.all["messages"][message]["fields"]
        if label.endswith(" bytes"):  # a section begins: its fields are looked up in it
            section = schema.all["messages"][message]["sections"][label.split(":")[0]]
        elif label.startswith("  "):
            fields = section["fields"]
        header_bytes += len(data)
        comment = meaning(schema, fields, label, value)
        for i, part in enumerate(grouped(data, width)):
            rows.append((part, comment if i == 0 else ""))
    return rows


def golden(schema, name):
    example = schema.all["examples"][name]
    if "recording_of" not in example:
        return hex_lines(golden_rows(schema, example))
    inside = golden_rows(schema, schema.all["examples"][example["recording_of"]])
    message = b"".join(data for data, _ in inside)
    crc = zlib.crc32(message).to_bytes(4, "little")
    return hex_lines([(b"BRCYREC1", "the file's magic"), *inside, (crc, "crc")])


def topology_hash(message):
    """FNV-1a over TOPOLOGY's body from offset 8 to the end of the positions: what stands before the name."""
    _, body, _ = message
    counts = [body["surface_vertex_count"], body["point_count"], body["triangle_count"], 0]
    data = struct.pack("<4I", *counts) + b"".join(struct.pack("<3I", *t) for t in body["triangles"]) + \
        b"".join(struct.pack("<3f", *p) for p in body["rest_positions"])
    value = 0xcbf29ce484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001b3 % 2**64
    return value


def example_differences(schema):
    """Examples that are not what their bytes mean, and fields and sections that no example has."""
    found, seen = [], set()
    for name, example in schema.all["examples"].items():
        if "recording_of" in example:
            continue
        message = example["message"]
        place = (example["sequence"], example["stamp_ns"])
        data = schema.encode(message, example["body"], example.get("sections"), *place)
        decoded = schema.decode(data)
        again = schema.encode(message, decoded[1], decoded[2], *place)
        if again != data:
            found.append(f"net/protocol.json: example {name} reads as other values than it has")
        if message == "TOPOLOGY" and topology_hash(decoded) != decoded[1]["hash"]:
            found.append(f"net/protocol.json: example {name}: hash is not {topology_hash(decoded):#x}")
        seen |= {message} | {f"{message}.{section}" for section in decoded[2]}
    wanted = set(schema.all["messages"])
    for message, content in schema.all["messages"].items():
        wanted |= {f"{message}.{section}" for section in content.get("sections", {})}
    return found + [f"net/protocol.json: no example has {name}" for name in sorted(wanted - seen)]


# --- the document ---

def missing_errors(schema, text):
    """The document's table of errors says of each code whether it is fatal."""
    return [f"net/PROTOCOL.md: the table of errors has no {number} {name}"
            for name, number in schema.all["enums"]["ErrorCode"]["values"].items()
            if not re.search(rf"^\| {number} {name} \| (yes|no) \|", text, re.M)]


def written(schema, text):
    """The document with the schema's tables and bytes, and what is wrong with its marks."""
    found, tables, blocks, lines, out = [], set(), set(), text.split("\n"), []
    at = 0
    while at < len(lines):
        line = lines[at]
        out.append(line)
        at += 1
        mark, fence = re.fullmatch(r"<!-- table: ([\w.]+) -->", line), re.fullmatch(r"```hex (\w+)", line)
        if not mark and not fence:
            continue
        end = "<!-- end -->" if mark else "```"
        name = (mark or fence)[1]
        if end not in lines[at:]:
            found.append(f"net/PROTOCOL.md: {line} has no {end}")
            continue
        try:
            out += table(schema, fields_of(schema, name)) if mark else golden(schema, name)
        except KeyError:
            found.append(f"net/protocol.json has no {name}")
        (tables if mark else blocks).add(name)
        at = lines.index(end, at)
    found += [f"net/PROTOCOL.md has no table {name}" for name in sorted(table_names(schema) - tables)]
    shown = {name for name, example in schema.all["examples"].items() if example.get("shown", True)}
    found += [f"net/PROTOCOL.md has no bytes of {name}" for name in sorted(shown - blocks)]
    return "\n".join(out), found


def differences(schema, text):
    found = schema.wrong_offsets() + example_differences(schema)
    new, marks = written(schema, text)
    found += marks + missing_errors(schema, text)
    for i, (old_line, new_line) in enumerate(zip(text.split("\n"), new.split("\n")), start=1):
        if old_line != new_line:
            found.append(f"net/PROTOCOL.md:{i}: {old_line!r} is not what --write writes: {new_line!r}")
            break
    else:
        if text != new:
            found.append("net/PROTOCOL.md is not what --write writes")
    return found, new


def main():
    schema = Schema()
    text = DOCUMENT.read_text(encoding="utf-8")
    try:
        if "--write" in sys.argv[1:]:
            new, _ = written(schema, text)
            DOCUMENT.write_text(new, encoding="utf-8")
            text = new
        found, _ = differences(schema, text)
    except WireError as error:
        found = [str(error)]
    for line in found:
        print(line)
    print(f"wire document: {len(found)} differences")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
