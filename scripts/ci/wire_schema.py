"""The native protocol from net/protocol.json alone: bytes from values and back, and offsets.

A field of the schema has
  name    `reserved` is written 0 and skipped
  type    u8 u16 u32 u64 i32 f32 f64 time text pose as in net/PROTOCOL.md, the name of one of "records", or sections
  count   absent: one value; a number: that many; [FIELD] or [FIELD, 3]: as many as the earlier field FIELD says, or
          three times as many; FIELD may be LIST.FIELD, the sum over the list's records
  spread  the record's fields stand in the message as if they were its own
  least, most  of a number; other values are refused
  bool    true: 0 or 1
and for clients' codecs (scripts/ci/wire_clients.py) default (of a field that a program does not state) and exact (64
bits that go back as they came: hashes, echoed stamps);
and for readers offset (checked: bytes from the start, where it is fixed), unit, enum or flags (of this file), symbol
and note.

Values: a record is a dictionary, an array a list; counts are worked out and may be left out; bytes are hex digits;
numbers that JSON lacks are "nan", "inf", "-inf"; of 64 bits also "0x…".
"""
import json
import pathlib
import struct

ROOT = pathlib.Path(__file__).resolve().parents[2]
FORMATS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i32": "i", "f32": "f", "f64": "d", "time": "Q"}
SIZES = {name: struct.calcsize("<" + code) for name, code in FORMATS.items()} | {"pose": 96}


def write_or_compare(files, writes, script):
    """Writes {path: text}, or tells which files differ, in complaints that name the script that writes them."""
    found = []
    for path, text in files.items():
        if writes:
            path.write_text(text, encoding="utf-8")
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            found.append(f"{path.relative_to(ROOT)} is not what scripts/ci/{script} --write writes")
    return found


class WireError(Exception):
    """Bytes or values that do not fit the schema."""


class Reader:
    def __init__(self, data):
        self.data, self.at = bytes(data), 0

    def take(self, count):
        if count > len(self.data) - self.at:
            raise WireError(f"{count} bytes expected at {self.at} of {len(self.data)}")
        self.at += count
        return self.data[self.at - count:self.at]

    def array(self, kind, count):
        return list(struct.unpack(f"<{count}{FORMATS[kind]}", self.take(count * SIZES[kind])))

    def scalar(self, kind):
        return struct.unpack("<" + FORMATS[kind], self.take(SIZES[kind]))[0]

    def finish(self):
        if self.at != len(self.data):
            raise WireError(f"{len(self.data) - self.at} bytes left over")


def packed(kind, value):
    if kind in ("f32", "f64"):
        value = float(value)
    elif isinstance(value, str):
        value = int(value, 0)
    try:
        return struct.pack("<" + FORMATS[kind], value)
    except struct.error as error:
        raise WireError(f"{value} is no {kind}") from error


def packed_array(kind, values):
    if any(isinstance(value, str) for value in values):
        return b"".join(packed(kind, value) for value in values)
    try:
        return struct.pack(f"<{len(values)}{FORMATS[kind]}", *values)
    except struct.error as error:
        raise WireError(f"{values} are not all {kind}") from error


def grouped(values, width):
    return [values[i:i + width] for i in range(0, len(values), width)]


class Schema:
    def __init__(self, path=ROOT / "net/protocol.json"):
        self.all = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
        self.records = {name: record["fields"] for name, record in self.all["records"].items()}
        self.types = self.all["enums"]["MessageType"]["values"]
        self.names = {number: name for name, number in self.types.items()}

    def size(self, field):
        """Bytes of a field; None where they vary."""
        kind, count = field["type"], field.get("count", 1)
        one = self.size_of(self.records[kind]) if kind in self.records else SIZES.get(kind)
        return None if one is None or not isinstance(count, int) else one * count

    def size_of(self, fields):
        sizes = [self.size(field) for field in fields]
        return None if None in sizes else sum(sizes)

    def counted_by(self, fields):
        """Name of a count → the field whose elements it counts."""
        return {field["count"][0]: field for field in fields if isinstance(field.get("count"), list)}

    # --- values to bytes ---

    def pieces(self, fields, values, sections=None, of="", prefix=""):
        """Yields (what it is, its value, its bytes, bytes a line) of each field."""
        counted = self.counted_by(fields)
        unknown = set(values) - {field["name"] for field in fields if not field.get("spread")}
        spread = [field for field in fields if field.get("spread")]
        unknown -= {inner["name"] for field in spread for inner in self.records[field["type"]]}
        if unknown:
            raise WireError(f"{of}: there is no {', '.join(sorted(unknown))}")
        for field in fields:
            name, kind, count = field["name"], field["type"], field.get("count", 1)
            label = prefix + name
            if kind == "sections":
                yield from self.section_pieces(of, sections or {})
            elif field.get("spread"):
                names = {inner["name"] for inner in self.records[kind]}
                inner = {key: value for key, value in values.items() if key in names}
                yield from self.pieces(self.records[kind], inner, None, of, prefix)
            elif name == "reserved":
                yield label, None, bytes(self.size(field)), 24
            elif name in counted:
                elements = values[counted[name]["name"]]
                is_hex = counted[name]["type"] == "u8"
                number = len(bytes.fromhex(elements)) if is_hex else len(elements)
                if values.get(name, number) != number:
                    raise WireError(f"{of}: {name} is {values[name]}, of {number} elements")
                yield label, number, packed(kind, number), 24
            elif name not in values:
                raise WireError(f"{of}: {label} is missing")
            elif kind in self.records:
                yield from self.record_pieces(field, values[name], of, label)
            else:
                yield self.value_piece(label, kind, count, values[name])

    def record_pieces(self, field, value, of, label):
        if "count" not in field:
            yield from self.pieces(self.records[field["type"]], value, None, of, label + ".")
            return
        for i, one in enumerate(value):
            yield from self.pieces(self.records[field["type"]], one, None, of, f"{label}[{i}].")

    def value_piece(self, label, kind, count, value):
        if kind == "u8" and count != 1:
            return label, None, bytes.fromhex(value), 16
        if kind == "pose":
            return label, None, b"".join(packed("f64", x) for row in value for x in row), 24
        if kind == "text":
            texts = value if isinstance(count, list) else [value]
            coded = [text.encode("utf-8") for text in texts]
            return label, json.dumps(value, ensure_ascii=False), b"".join(packed("u16", len(c)) + c for c in coded), 24
        if count == 1:
            return label, value, packed(kind, value), 24
        is_grouped = isinstance(count, list) and len(count) == 2
        flat = [x for group in value for x in group] if is_grouped else value
        return label, None, packed_array(kind, flat), count[1] * SIZES[kind] if is_grouped else 24

    def section_pieces(self, of, sections):
        known = self.all["messages"][of].get("sections", {})
        yield "sections", len(sections), packed("u16", len(sections)), 24
        yield "reserved", None, bytes(2), 24
        for name, values in sections.items():
            if name not in known:
                raise WireError(f"{of} has no section {name}")
            inside = list(self.pieces(known[name]["fields"], values, None, of + "." + name, "  "))
            length = sum(len(piece[2]) for piece in inside)
            number = known[name]["id"]
            yield f"{name}: id, reserved, {length} bytes", None, struct.pack("<HHI", number, 0, length), 24
            yield from inside

    def message_pieces(self, name, body, sections=None, sequence=1, stamp_ns=0):
        """Of header and body."""
        inside = list(self.pieces(self.all["messages"][name]["fields"], body, sections, name))
        header = {"magic": "42524359", "version": self.all["constants"]["PROTOCOL_VERSION"]["value"],
                  "type": self.types[name], "flags": 0, "length": sum(len(piece[2]) for piece in inside),
                  "sequence": sequence, "stamp_ns": stamp_ns}
        return list(self.pieces(self.all["header"]["fields"], header, None, "header")) + inside

    def encode(self, name, body, sections=None, sequence=1, stamp_ns=0):
        return b"".join(piece[2] for piece in self.message_pieces(name, body, sections, sequence, stamp_ns))

    # --- bytes to values ---

    def decode_header(self, data):
        header, _ = self.read(Reader(data[:32]), self.all["header"]["fields"], "header")
        if header["magic"] != "42524359" or header["version"] != 1:
            raise WireError(f"no header: {header}")
        return header

    def decode(self, data):
        """(header, body, sections) of a whole message; sections of unknown id are left out."""
        header = self.decode_header(data)
        name = self.names[header["type"]]
        reader = Reader(data[32:])
        body, sections = self.read(reader, self.all["messages"][name]["fields"], name)
        reader.finish()
        return header, body, sections

    def read(self, reader, fields, of):
        values, sections = {}, {}
        for field in fields:
            name, kind, count = field["name"], field["type"], field.get("count", 1)
            if kind == "sections":
                sections = self.read_sections(reader, of)
            elif name == "reserved":
                reader.take(self.size(field))
            elif field.get("spread"):
                values |= self.read(reader, self.records[kind], of)[0]
            elif "count" not in field:
                values[name] = self.read_one(reader, kind)
                if "least" in field or "most" in field or field.get("bool"):
                    self.check(field, values[name], of)
            else:
                number = self.number(count, values)
                group = count[1] if isinstance(count, list) and len(count) == 2 else 0
                if kind == "u8":
                    values[name] = reader.take(number).hex()
                    continue
                if number > len(reader.data):
                    raise WireError(f"{of}: {number} {name} in {len(reader.data)} bytes")
                number *= group or 1
                read = reader.array(kind, number) if kind in FORMATS else \
                    [self.read_one(reader, kind) for _ in range(number)]
                values[name] = grouped(read, group) if group else read
        return values, sections

    @staticmethod
    def check(field, value, of):
        most = 1 if field.get("bool") else field.get("most", value)
        if not field.get("least", value) <= value <= most:
            raise WireError(f"{of}: {field['name']} is {value}")

    @staticmethod
    def number(count, values):
        if isinstance(count, int):
            return count
        listed, _, field = count[0].partition(".")
        return sum(record[field] for record in values[listed]) if field else values[listed]

    def read_one(self, reader, kind):
        if kind in self.records:
            return self.read(reader, self.records[kind], kind)[0]
        if kind == "text":
            return reader.take(reader.scalar("u16")).decode("utf-8")
        if kind == "pose":
            return [[reader.scalar("f64") for _ in range(4)] for _ in range(3)]
        return reader.scalar(kind)

    def read_sections(self, reader, of):
        listed = self.all["messages"][of].get("sections", {})
        known = {section["id"]: (name, section) for name, section in listed.items()}
        sections, count = {}, reader.scalar("u16")
        reader.take(2)
        for _ in range(count):
            number, _, length = struct.unpack("<HHI", reader.take(8))
            payload = Reader(reader.take(length))
            if number in known:
                name, section = known[number]
                sections[name], _ = self.read(payload, section["fields"], f"{of}.{name}")
                payload.finish()
        return sections

    # --- checks ---

    def wrong_offsets(self):
        """A line for each offset of the file that is not where the field is."""
        found = []
        tables = {"header": self.all["header"]["fields"]} | self.records
        for name, message in self.all["messages"].items():
            tables[name] = message["fields"]
            for section, content in message.get("sections", {}).items():
                tables[f"{name}.{section}"] = content["fields"]
        for table, fields in tables.items():
            at = 0
            for field in fields:
                if field.get("offset") != at:
                    found.append(f"net/protocol.json: {table}.{field['name']} is at {at}, not {field.get('offset')}")
                size = self.size(field)
                at = None if at is None or size is None else at + size
        return found
