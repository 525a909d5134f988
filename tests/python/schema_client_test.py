#!/usr/bin/env python3
"""An operator and two devices that know net/protocol.json alone, against a running brachyd: they write what they send
from its fields, and each message that comes is read by its fields to the end and written again as the same bytes.

usage: tests/python/schema_client_test.py BRACHYD
"""
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/ci"))
from waiting import DEADLINE_S, wait_until  # pylint: disable=wrong-import-position
from wire_schema import Schema  # pylint: disable=wrong-import-position

SCHEMA = Schema()
# (code, whether it is fatal) of the document's table of errors.
DOCUMENT = (ROOT / "net/PROTOCOL.md").read_text(encoding="utf-8")
ERRORS = {(int(code), int(fatal == "yes"))
          for code, fatal in re.findall(r"^\| (\d+) [A-Z_]+ \| (yes|no) \|", DOCUMENT, re.M)}
FLAGS, ENUMS = SCHEMA.all["flags"], SCHEMA.all["enums"]
if len(sys.argv) < 2:
    sys.exit(__doc__)
BRACHYD = os.path.abspath(sys.argv[1])

# Two needles that bend, a probe, a plan and ultrasound: every section of FRAME and SCENE has something to say.
SCENE = f"""
[tissue]
points = 600
phantom_surface_vertices = 150
[model]
kernel = "elastic"
[needle]
flexible = true
count = 2
[probe]
on = true
[plan]
file = "{ROOT}/config/plan.toml"
[ultrasound]
width_px = 64
height_px = 64
lines = 32
rate_hz = 2
[rates]
deformation_hz = 50
snapshot_hz = 5
"""


def bits(kind, *names):
    return sum(FLAGS[kind]["values"][name] for name in names)


class Peer:
    """One connection. `seen` maps a message's name to its bodies, `sections` has MESSAGE.SECTION of all that came."""

    def __init__(self, address, role, subscription, sections):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=DEADLINE_S)
        self.sequence, self.received, self.data = 0, 0, b""
        self.seen, self.sections, self.different = {}, {}, []
        limits = dict.fromkeys(("max_force_n", "max_stiffness_n_per_mm", "damping_n_s_per_mm"), "nan") | {"rate_hz": 50}
        body = {"role": ENUMS["Role"]["values"][role], "subscription": subscription, "name": "schema", **limits}
        self.send("HELLO", body, sections)

    def send(self, name, body, sections=None):
        self.sequence += 1
        try:
            self.socket.sendall(SCHEMA.encode(name, body, sections, self.sequence, time.monotonic_ns()))
        except (BrokenPipeError, ConnectionResetError):
            pass  # poll() has the server's reason

    def poll(self, seconds=0.0):
        self.socket.settimeout(max(seconds, 1e-3))
        try:
            data = self.socket.recv(1 << 20)
            if not data:
                raise AssertionError(f"brachyd closed the connection: {self.seen.get('ERROR')}")
            self.data += data
        except TimeoutError:
            return
        while len(self.data) >= 32:
            length = 32 + SCHEMA.decode_header(self.data)["length"]
            if len(self.data) < length:
                return
            self.take(self.data[:length])
            self.data = self.data[length:]

    def take(self, data):
        header, body, sections = SCHEMA.decode(data)
        name = SCHEMA.names[header["type"]]
        self.received += 1
        if header["sequence"] != self.received:
            self.different.append(f"sequence {header['sequence']}, not {self.received}")
        if SCHEMA.encode(name, body, sections, header["sequence"], header["stamp_ns"]) != data:
            self.different.append(name)
        if name == "ERROR" and (body["code"], body["fatal"]) not in ERRORS:
            self.different.append(f"{body} is not in the table of errors")
        self.seen.setdefault(name, []).append(body)
        for section, content in sections.items():
            self.sections.setdefault(f"{name}.{section}", []).append(content)
        if name == "PING" and body["reply"] == 0:
            self.send("PING", {"nonce": body["nonce"], "reply": 1, "echoed_stamp_ns": header["stamp_ns"],
                               "received_ns": time.monotonic_ns()})

    def codes(self):
        return [error["code"] for error in self.seen.get("ERROR", [])]


def device(address, needle, flags):
    return Peer(address, "DEVICE", bits("Subscription", "NO_MESH"), {"DEVICE": {"needle": needle, "flags": flags}})


class SchemaClient(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        scene = pathlib.Path(self.folder.name) / "scene.toml"
        scene.write_text(SCENE, encoding="utf-8")
        self.process = subprocess.Popen([BRACHYD, "--config", scene, "--port", "0", "--duration", str(2 * DEADLINE_S)],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end)
        line = self.process.stdout.readline()
        found = re.match(r"brachyd listening on (.*:\d+)$", line)
        self.assertTrue(found, line or self.process.stderr.read())
        self.address = found[1]

    def end(self):
        self.process.terminate()
        self.process.communicate(timeout=DEADLINE_S)

    def insert(self, needle, pressed):
        """The needle's next pose; in the tissue its button goes down and up."""
        depth = -60 + 0.5 * min(needle.sequence, 150)
        needle.send("POSE", {"needle": needle.number, "flags": 0,
                             "X_WN": [[1, 0, 0, 5 + 10 * needle.number], [0, 1, 0, 0], [0, 0, 1, depth]]})
        if depth > 0 and needle.pressed != pressed:
            needle.pressed = pressed
            needle.send("DROP", {"needle": needle.number, "pressed": int(pressed)})

    def test_every_message_is_read_by_the_schemas_fields_and_written_again_as_the_same_bytes(self):
        operator = Peer(self.address, "OPERATOR", bits("Subscription", "POSE_HISTORY", "SCENE", "ULTRASOUND"),
                        {"SOFTWARE": {"software": "schema 1"},
                         "IMAGES": {"flags": bits("ImageRequestFlag", "TAKES_ZLIB")}})
        needles = [device(self.address, 0, bits("DeviceFlag", "EVALUATES_LOCAL_MODEL")), device(self.address, 1, 0)]
        for peer in (operator, *needles):
            self.addCleanup(peer.socket.close)
        for number, needle in enumerate(needles):
            needle.number, needle.pressed = number, False
        control = ENUMS["ControlAction"]["values"]
        operator.send("CONTROL", {"action": control["MODEL"], "flags": 0, "support_radius_mm": "nan", "kernel": "none"})
        operator.send("LOAD", {"needle": 7, "plan_needle": 0})
        operator.send("SCANNER", {"array": 1, "freeze": 1, "flags": 0, "tick": 0, "gain_db": 3, "depth_mm": "nan",
                                  "dynamic_range_db": "nan", "tgc_extra_db_per_cm": "nan", "focus_mm": "nan",
                                  "probe_depth_mm": "nan", "probe_rotation_deg": "nan"}, {})
        needles[0].send("ARM", {"needle": 0})
        wanted = {"WELCOME", "TOPOLOGY", "SCENE", "FRAME", "STATE", "EVENT", "ERROR", "DOSE", "SCANNER", "IMAGE",
                  "WELCOME.DEVICE", "STATE.CONTROLS", "SCENE.PROBE", "DOSE.AT_SURFACE", "DOSE.WITH_PLANNED",
                  "FRAME.FORCE", "FRAME.SEEDS", "FRAME.CERTIFICATE", "FRAME.POSE_HISTORY", "FRAME.POSES_OF_NEEDLES",
                  "FRAME.BUTTONS", "FRAME.NEEDLE_SHAPES", "FRAME.LAG"}
        of_device = {"FORCE", "WELCOME.LIMITS", "PING"}
        turn = 0

        def serve():
            nonlocal turn
            turn += 1
            for needle in needles:
                self.insert(needle, turn // 40 % 2 == 1)
                needle.poll()
            operator.poll(0.005)

        def has_seen_all():
            have = operator.seen.keys() | operator.sections.keys()
            return have >= wanted and needles[0].seen.keys() >= {"LOCAL_MODEL"} and len(operator.codes()) >= 2 and \
                needles[1].seen.keys() | needles[1].sections.keys() >= of_device

        try:
            wait_until(has_seen_all, serve)
        except TimeoutError:
            pass  # what is missing is named below
        for peer in (operator, *needles):
            self.assertEqual(peer.different, [])
        self.assertEqual(wanted - (operator.seen.keys() | operator.sections.keys()), set())
        self.assertEqual(of_device - (needles[1].seen.keys() | needles[1].sections.keys()), set())
        self.assertIn("LOCAL_MODEL", needles[0].seen)
        self.assertEqual(set(operator.codes()) & {11, 13}, {11, 13})
        self.check_content(operator)

        self.check_refusal(needles[0])
        self.check_reset(operator, needles)

    def check_refusal(self, needle):
        """A second device is told by a fatal ERROR, and nothing follows."""
        second = device(self.address, needle.number, 0)
        self.addCleanup(second.socket.close)
        with self.assertRaises(AssertionError):
            wait_until(lambda: False, lambda: second.poll(0.02))
        self.assertEqual([(error["code"], error["fatal"]) for error in second.seen["ERROR"]], [(5, 1)])
        self.assertEqual(second.different, [])

    def check_reset(self, operator, needles):
        """Ticks count from 1, the next FRAME is full, and a DOSE without seeds follows, since seeds had fallen."""
        for needle in needles:
            needle.send("DROP", {"needle": needle.number, "pressed": 0})
            needle.send("PING", {"nonce": 77, "reply": 0, "echoed_stamp_ns": 0, "received_ns": 0})

        def serve():
            for peer in (operator, *needles):
                peer.poll(0.005)

        def is_answered(needle):
            return any(ping["reply"] == 1 and ping["nonce"] == 77 for ping in needle.seen["PING"])

        wait_until(lambda: all(is_answered(needle) for needle in needles), serve)  # the DROPs came before
        frames = len(operator.seen["FRAME"])
        wait_until(lambda: len(operator.seen["FRAME"]) >= frames + 2, serve)  # a tick has seen them
        before = operator.seen["FRAME"][-1]["tick"]
        operator.seen = {}
        operator.send("CONTROL", {"action": ENUMS["ControlAction"]["values"]["RESET"], "flags": 0,
                                  "support_radius_mm": "nan", "kernel": ""})

        def frames_of_reset():
            return [frame for frame in operator.seen.get("FRAME", []) if frame["tick"] < before]

        def is_emptied():
            return any(dose["seeds"] == 0 for dose in operator.seen.get("DOSE", []))

        wait_until(lambda: frames_of_reset() and is_emptied(), serve)
        resets = frames_of_reset()
        self.assertEqual((resets[0]["frame_flags"], resets[0]["base_tick"]), (1, 0))
        self.assertGreaterEqual(resets[0]["tick"], 1)
        emptied, = [dose for dose in operator.seen.get("DOSE", []) if dose["seeds"] == 0]
        self.assertTrue(all(structure["max_gy"] == 0 for structure in emptied["structures"]))
        self.assertIn(ENUMS["EventKind"]["values"]["RESET"], [event["kind"] for event in operator.seen["EVENT"]])
        self.assertEqual(operator.different, [])

    def check_content(self, operator):
        topology, = operator.seen["TOPOLOGY"]
        first = operator.seen["FRAME"][0]
        count = topology["point_count"]
        self.assertEqual((first["base_tick"], first["frame_flags"]), (0, 1))
        self.assertEqual(first["ranges"], [{"first": 0, "count": count}])
        data = struct.pack("<4I", topology["surface_vertex_count"], count, topology["triangle_count"], 0) + \
            b"".join(struct.pack("<3I", *corners) for corners in topology["triangles"]) + \
            b"".join(struct.pack("<3f", *point) for point in topology["rest_positions"])
        value = 0xcbf29ce484222325
        for byte in data:
            value = (value ^ byte) * 0x100000001b3 % 2**64
        self.assertEqual((topology["hash"], operator.seen["WELCOME"][0]["topology_hash"]), (value, value))
        for before, after in zip(operator.seen["FRAME"], operator.seen["FRAME"][1:]):
            self.assertLessEqual(after["base_tick"], before["tick"])
            self.assertGreater(after["tick"], before["tick"])
        self.assertEqual(operator.sections["FRAME.NEEDLE_SHAPES"][-1]["entries"][0]["point_count"], 17)
        last = operator.sections["FRAME.SEEDS"][-1]
        self.assertGreaterEqual(last["seed_count"], 1)
        self.assertEqual(operator.seen["SCANNER"][-1]["gain_db"], 3)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
