#!/usr/bin/env python3
"""apps/python against the document: the golden bytes of net/PROTOCOL.md and LOCAL_MODEL's test vectors; no daemon.

usage: tests/python/wire_test.py     exit code 77: skipped, with its reason
"""
import json
import math
import pathlib
import random
import re
import struct
import sys
import types
import unittest
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "apps/python"))
sys.path.insert(0, str(ROOT / "scripts/ci"))
try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is missing")
    sys.exit(77)

import brachyd
import wire_clients
from brachyd import wire, wire_generated
from brachyd.constants import ErrorCode, ForceFlag, MessageType


def golden_blocks():
    """Name → bytes of each hex block of the document."""
    blocks = {}
    text = (ROOT / "net/PROTOCOL.md").read_text(encoding="utf-8")
    for name, block in re.findall(r"```hex (\w+)\n(.*?)```", text, re.S):
        digits = "".join(line.split("#")[0] for line in block.splitlines())
        blocks[name] = bytes.fromhex(digits)
    return blocks


BLOCKS = golden_blocks()


def decoded(name):
    data = BLOCKS[name]
    header = wire.decode_header(data)
    reader = wire.Reader(data[32:])
    message = wire.DECODERS[header.type](reader)
    reader.finish()
    return message


class Golden(unittest.TestCase):
    def test_every_server_message_is_read_to_its_end(self):
        for name in ("WELCOME", "TOPOLOGY", "FRAME", "STATE", "EVENT", "ERROR", "PING", "FORCE", "LOCAL_MODEL", "DOSE",
                     "DOSE_PLANNED", "SCENE", "IMAGE", "SCANNER", "PLAN", "CONTOUR"):
            with self.subTest(name):
                decoded(name)
        # What a client says is not read by one.
        for name in ("HELLO", "POSE", "ARM", "DROP", "CONTROL", "LOAD", "EXERCISE"):
            self.assertNotIn(MessageType[name], wire.DECODERS)

    def test_hello_is_written_as_the_document_has_it(self):
        hello = wire.Hello(brachyd.Role.DEVICE, "touch", brachyd.Subscription.POSE_HISTORY, 3.3, 1.0, rate_hz=1000,
                           needle=2, evaluates_local_model=True)
        self.assertEqual(wire.encode_message(MessageType.HELLO, hello.encode(), 1, 1_000_000_001), BLOCKS["HELLO"])
        operator = wire.Hello(brachyd.Role.OPERATOR, "desk", token=bytes(range(0xe0, 0x100)), software="desk 2.1")
        message = wire.encode_message(MessageType.HELLO, operator.encode(), 1, 1_000_000_002)
        self.assertEqual(message, BLOCKS["HELLO_TOKEN"])

    def test_pose_and_control_are_written_as_the_document_has_them(self):
        reader = wire.Reader(BLOCKS["POSE"][40:])
        X_WN = reader.pose()
        message = wire.encode_message(MessageType.POSE, wire.encode_pose(2, X_WN), 17, 1_000_000_500)
        self.assertEqual(message, BLOCKS["POSE"])
        body = wire.encode_control(brachyd.ControlAction.MODEL, True, "psi32", 18.5)
        self.assertEqual(wire.encode_message(MessageType.CONTROL, body, 21, 1_000_000_900), BLOCKS["CONTROL"])

    def test_fields_hold_what_the_document_says(self):
        welcome = decoded("WELCOME")
        self.assertEqual((welcome.session, welcome.deformation_hz), (7, 200))
        self.assertEqual((welcome.needle, welcome.needle_count), (2, 3))
        self.assertEqual(welcome.limits, wire.Limits(3.5, 1, 0.0005, 1000, 4))
        frame = decoded("FRAME")
        self.assertEqual((frame.tick, frame.base_tick, frame.point_count), (42, 40, 5))
        self.assertEqual(frame.positions.tolist(), [[10, 0.5, -0.25], [0, 0, 9]])
        self.assertEqual(frame.needles[0].forces.force_n.tolist(), [0.5, -0.25, 2])
        self.assertEqual(frame.needles[0].tip_depth_mm, 14.5)
        self.assertEqual(frame.needles[0].shape.shape, (17, 3))
        self.assertEqual((frame.seeds[0].id, frame.seeds[0].planned), (2, 1))
        model = decoded("LOCAL_MODEL")
        self.assertEqual(model.flags, ForceFlag.ARMED | ForceFlag.LIMITED)
        self.assertEqual((model.axial_max_n, model.after_puncture_n, model.max_slew_n_per_ms), (math.inf, 1.75, 0.5))
        self.assertEqual(decoded("ERROR").code, ErrorCode.POSE_REFUSED)
        self.assertEqual(decoded("DOSE").structures[0].name, "prostate")
        self.assertEqual(decoded("SCENE").kernels, ["psi31", "elastic"])

    def test_what_sections_say_is_found_where_programs_look_for_it(self):
        frame = decoded("FRAME")
        needle = frame.needles[0]
        self.assertEqual((needle.input_sequence, needle.input_stamp_ns, needle.present), (17, 1_000_000_500, True))
        self.assertEqual((frame.is_full, frame.seed_count, frame.seeds[0].is_certified), (False, 2, True))
        self.assertEqual((frame.certificate.verdict, frame.certificate.substeps), (1, 3))
        self.assertEqual(frame.lag_mm, 0.375)
        self.assertEqual(needle.shape[-1].tolist(), [3.5, -2, 30.25])
        state = decoded("STATE")
        self.assertEqual((state.kernel, state.support_radius_mm, state.control_flags), ("psi31", 12, 3))
        self.assertEqual([(r.count, r.code, r.text) for r in state.refusals], [(5, 0xff01, "too many")])
        surface = decoded("DOSE").surface_gy
        self.assertEqual(surface[0], 150)
        self.assertTrue(math.isnan(surface[1]))
        self.assertIsNone(decoded("DOSE").sections.with_planned)
        self.assertEqual(decoded("DOSE_PLANNED").sections.with_planned.structures[0].d90_gy, 145)
        fraction = decoded("DOSE_PLANNED").sections.fraction
        self.assertEqual((fraction.catheters, fraction.planned_catheters, fraction.seconds), (4, 18, 140.5))
        self.assertEqual(decoded("TOPOLOGY").rest[4].tolist(), [2.5, 2.5, 2.5])
        scene = decoded("SCENE")
        self.assertEqual((scene.planned_needles[0].hole, scene.planned_seeds[0].needle), ("G5", 0))
        self.assertEqual((scene.sections.probe.needle, scene.sections.goals.goals[0].figure), (3, "D90"))
        plan = decoded("PLAN")
        self.assertEqual([(n.number, n.hole, n.train) for n in plan.needles], [(4, "E7", "s-s--s"), (9, "G5", "ss")])
        contour = decoded("CONTOUR")
        self.assertEqual(contour.slices[0].points.tolist(), [[20, 30], [40, 30], [30, 50.5]])
        self.assertEqual((contour.about_sequence, contour.sections.score.planes[0].dice), (22, 0.75))

    def test_an_image_has_its_pixels_and_their_places(self):
        image = decoded("IMAGE")
        self.assertEqual((image.array, image.flags), (brachyd.ScannerArray.SAGITTAL, brachyd.ImageFlag.HELD))
        self.assertEqual((image.sequence, image.tick, image.newest_tick), (7, 40, 42))
        self.assertEqual(image.pixels.dtype, np.uint8)
        self.assertEqual(image.pixels.tolist(), [[0, 64, 128], [192, 255, 1]])
        self.assertEqual(image.place(0, 0).tolist(), [1.5, 60.5, -2.25])
        self.assertEqual(image.place(2, 1).tolist(), [1.5, 60.25, -2.75])  # two along −z, one along −y

    def test_compressed_pixels_are_read_and_damaged_ones_refused(self):
        body = BLOCKS["IMAGE"][32:]
        pixels = decoded("IMAGE").pixels.tobytes()

        def packed(data):
            flags = int(brachyd.ImageFlag.ZLIB).to_bytes(2, "little")
            return body[:2] + flags + body[4:144] + len(data).to_bytes(4, "little") + data + bytes(4)

        good = zlib.compress(pixels)
        self.assertEqual(wire.Image.read(wire.Reader(packed(good))).pixels.tobytes(), pixels)
        for bad in (good[:-1], good + b"x", zlib.compress(pixels + b"x"), zlib.compress(pixels[1:]), b"x" * 20, b""):
            with self.subTest(bad), self.assertRaises(wire.ProtocolError):
                wire.Image.read(wire.Reader(packed(bad)))

    def test_scanner_is_written_as_the_document_has_it(self):
        body = decoded("SCANNER").encode()
        self.assertEqual(wire.encode_message(MessageType.SCANNER, body, 22, 1_000_001_000), BLOCKS["SCANNER"])

    def test_a_message_that_is_cut_or_too_long_is_refused(self):
        for name in ("WELCOME", "FRAME", "STATE", "DOSE", "SCENE", "IMAGE", "SCANNER"):
            body = BLOCKS[name][32:]
            decode = wire.DECODERS[wire.decode_header(BLOCKS[name]).type]
            for end in range(0, len(body), 7):
                with self.assertRaises(wire.ProtocolError):
                    reader = wire.Reader(body[:end])
                    decode(reader)
                    reader.finish()

    def test_the_wire_protocol_in_any_pieces(self):
        for size in (1, 7, 100_000):
            protocol = brachyd.Protocol(brachyd.Hello())
            stream, messages = b"", []
            for i, name in enumerate(("WELCOME", "TOPOLOGY"), start=1):
                header = wire.decode_header(BLOCKS[name])
                stream += wire.encode_message(header.type, BLOCKS[name][32:], i, 0)
            for at in range(0, len(stream), size):
                messages += protocol.feed(stream[at:at + size])
            self.assertEqual(len(messages), 2)
            self.assertEqual(protocol.positions[1].tolist(), [10, 0, 0])
            with self.assertRaises(ValueError):
                protocol.positions[0, 0] = 1

    def test_a_fatal_error_is_raised_with_its_code(self):
        body = bytearray(BLOCKS["ERROR"][32:])
        body[2] = 1
        with self.assertRaises(brachyd.ServerError) as caught:
            brachyd.Protocol(brachyd.Hello()).feed(wire.encode_message(MessageType.ERROR, bytes(body), 1, 0))
        self.assertEqual(caught.exception.error.code, ErrorCode.POSE_REFUSED)


def with_section(message, number, payload):
    """The message's body with one more section."""
    w = wire.Writer()
    message.sections.write(w) if hasattr(message, "sections") else w.sections([])
    body = message.encode()
    at = len(body) - len(w.data)
    count = struct.unpack_from("<H", body, at)[0]
    return (body[:at] + struct.pack("<H", count + 1) + body[at + 2:] +
            struct.pack("<HHI", number, 0, len(payload)) + payload)


class Generated(unittest.TestCase):
    """The codecs that scripts/ci/wire_clients.py writes."""

    def test_every_message_of_the_document_is_read_and_written_again_bit_for_bit(self):
        seen = set()
        for name, block in BLOCKS.items():
            if name == "RECORDING":
                continue
            with self.subTest(name):
                header = wire.decode_header(block)
                reader = wire.Reader(block[32:])
                message = wire_generated.MESSAGES[header.type].read(reader)
                reader.finish()
                self.assertEqual(message.TYPE, header.type)
                self.assertEqual(message.encode(), block[32:])
                seen.add(message.TYPE)
        self.assertEqual(seen, set(MessageType))

    def test_a_message_cut_anywhere_or_with_a_byte_too_many_is_refused(self):
        for name, block in BLOCKS.items():
            if name == "RECORDING":
                continue
            kind, body = wire_generated.MESSAGES[wire.decode_header(block).type], block[32:]
            for other in [body[:end] for end in range(len(body))] + [body + b"x"]:
                with self.assertRaises(wire.ProtocolError, msg=f"{name} of {len(other)} bytes"):
                    reader = wire.Reader(other)
                    kind.read(reader)
                    reader.finish()

    def test_a_section_of_a_later_version_is_skipped_in_every_message_that_has_sections(self):
        with_sections = set()
        schema = json.loads((ROOT / "net/protocol.json").read_text(encoding="utf-8"))
        for name, message in schema["messages"].items():
            if not any(field["type"] == "sections" for field in message["fields"]):
                continue
            with_sections.add(name)
            body, kind = BLOCKS[name][32:], wire_generated.MESSAGES[MessageType[name]]
            longer = with_section(kind.read(wire.Reader(body)), 999, b"what a later version says")
            self.assertGreater(len(longer), len(body) + 8)
            reader = wire.Reader(longer)
            read = kind.read(reader)
            reader.finish()
            self.assertEqual(read.encode(), body)
        self.assertGreaterEqual(with_sections, {"HELLO", "WELCOME", "TOPOLOGY", "FRAME", "STATE", "SCENE", "DOSE"})

    def test_a_section_that_is_absent_is_none_and_its_values_are_the_defaults(self):
        frame = wire_generated.Frame()
        reader = wire.Reader(frame.encode())
        again = wire_generated.Frame.read(reader)
        reader.finish()
        self.assertIsNone(again.certificate)
        self.assertIsNone(again.lag_mm)
        self.assertEqual((again.seeds, again.seed_count, again.is_full), ([], 0, False))
        state = wire_generated.State.read(wire.Reader(wire_generated.State().encode()))
        self.assertEqual((state.kernel, state.support_radius_mm, state.control_flags), ("", 0, 0))
        welcome = wire_generated.Welcome.read(wire.Reader(wire_generated.Welcome().encode()))
        self.assertEqual((welcome.needle, welcome.needle_count, welcome.limits), (0xffff, 1, None))

    def test_limits_of_the_schema_are_kept(self):
        image = wire_generated.Image(width=4097, height=0)
        plan = wire_generated.Plan(needles=[wire_generated.PlanNeedle()] * 4097)
        shape = wire_generated.NeedleShape(points=np.zeros((1, 3), np.float32))
        for message in (image, plan):
            with self.assertRaises(wire.ProtocolError):
                type(message).read(wire.Reader(message.encode()))
        w = wire.Writer()
        shape.write(w)
        with self.assertRaises(wire.ProtocolError):
            wire_generated.NeedleShape.read(wire.Reader(bytes(w.data)))
        for name, offset in (("ERROR", 2), ("PING", 8), ("DROP", 2)):  # 0 or 1
            body = bytearray(BLOCKS[name][32:])
            body[offset] = 2
            with self.assertRaises(wire.ProtocolError, msg=name):
                wire_generated.MESSAGES[MessageType[name]].read(wire.Reader(bytes(body)))

    def test_what_is_no_text_or_names_a_needle_that_is_not_there_is_refused(self):
        body = bytearray(BLOCKS["EVENT"][32:])
        body[18] = 0xff
        with self.assertRaises(wire.ProtocolError):
            wire_generated.Event.read(wire.Reader(bytes(body)))
        for sections in (wire_generated.FrameSections(force=wire_generated.FrameForce([wire_generated.NeedleForce(7)])),
                         wire_generated.FrameSections(needle_shapes=wire_generated.FrameNeedleShapes(
                             [wire_generated.NeedleShape(7, points=np.zeros((2, 3), np.float32))]))):
            frame = wire_generated.Frame(needles=[wire_generated.Needle()], sections=sections)
            with self.assertRaises(wire.ProtocolError):
                wire_generated.Frame.read(wire.Reader(frame.encode()))

    def test_what_does_not_fit_is_not_written(self):
        for message in (wire_generated.HelloToken(bytes(31)), wire_generated.Pose(X_WN=np.eye(3))):
            with self.assertRaises(ValueError):
                message.write(wire.Writer())


class Damaged(unittest.TestCase):
    def test_a_damaged_body_is_a_protocol_error_whatever_the_damage(self):
        random.seed(46)
        messages = [data for data in BLOCKS.values() if data[:6] == BLOCKS["FRAME"][:6]]
        bodies = [(wire.decode_header(data).type, data[32:]) for data in messages]
        bodies = [(kind, body) for kind, body in bodies if kind in wire.DECODERS and body]
        self.assertGreater(len(bodies), 14)
        refused = 0
        for kind, body in bodies:
            for _ in range(1500):
                damaged = bytearray(body)
                for _ in range(random.choice((1, 1, 2, 5))):
                    at = random.randrange(len(damaged))
                    damaged[at] = random.choice((0, 1, 0x7F, 0x80, 0xFF, random.randrange(256)))
                if random.randrange(4) == 0:
                    del damaged[random.randrange(len(damaged)):]
                message = wire.encode_message(kind, bytes(damaged), 1, 0)
                try:
                    brachyd.Protocol(brachyd.Hello()).feed(message)
                except (brachyd.ProtocolError, brachyd.ServerError):
                    refused += 1
        self.assertGreater(refused, 1000)


class AgainstTheRules(unittest.TestCase):
    def test_what_only_a_client_may_send_is_refused(self):
        for name in ("HELLO", "POSE", "ARM", "DROP", "CONTROL", "LOAD"):
            kind = wire.decode_header(BLOCKS[name]).type
            with self.subTest(name), self.assertRaises(brachyd.ProtocolError):
                wire.decode(kind, BLOCKS[name][32:])

    def test_forces_that_are_no_numbers_are_refused_save_infinite_bounds(self):
        bounds = (112, 120, 128)  # of LOCAL_MODEL: axial_min_n, axial_max_n, after_puncture_n
        for name, first, count in (("FORCE", 32, 13), ("LOCAL_MODEL", 32, 22)):
            kind = wire.decode_header(BLOCKS[name]).type
            for at in range(first, first + 8 * count, 8):
                for value in (math.nan, math.inf, -math.inf):
                    body = bytearray(BLOCKS[name][32:])
                    struct.pack_into("<d", body, at, value)
                    with self.subTest(name, at=at, value=value):
                        if name == "LOCAL_MODEL" and at in bounds and not math.isnan(value):
                            self.assertIsNotNone(wire.decode(kind, body))
                        else:
                            self.assertRaises(brachyd.ProtocolError, wire.decode, kind, body)


class LaterVersion(unittest.TestCase):
    """Of a schema with one more section, one of another type of field each; the codec is made of it as today's is."""

    def setUp(self):
        schema = wire_clients.Schema()
        fields = [("count", "u16", None), ("kind", "u8", None), ("reserved", "u8", None), ("names", "text", ["count"]),
                  ("X_WN", "pose", None), ("rows", "f32", ["count", 3]), ("pairs", "f64", ["count", 2]),
                  ("poses", "needle_poses", ["count"]), ("note", "text", None)]
        section = [{"name": name, "type": kind} | ({"count": count} if count else {}) for name, kind, count in fields]
        for message in schema.all["messages"].values():
            if any(field["type"] == "sections" for field in message["fields"]):
                message.setdefault("sections", {})["LATER"] = {"id": 77, "fields": section}
        views = wire_clients.VIEWS.read_text(encoding="utf-8")
        self.later = types.ModuleType("brachyd.wire_later")
        self.later.__package__ = "brachyd"
        sys.modules["brachyd.wire_later"] = self.later
        exec(wire_clients.Python(schema, views).text(), self.later.__dict__)  # pylint: disable=exec-used
        self.scripts = wire_clients.TypeScript(schema).text()

    def test_its_section_is_read_by_its_codec_and_skipped_by_todays(self):
        tried = 0
        for kind, today in wire_generated.MESSAGES.items():
            newer = self.later.MESSAGES[kind]
            if "sections" not in newer.__dataclass_fields__:
                continue
            body = BLOCKS[MessageType(kind).name][32:]
            message = newer.read(wire.Reader(body))
            section = getattr(self.later, f"{newer.__name__}Later")
            poses = [self.later.NeedlePoses(i, [self.later.TickPose(i, np.eye(4))] * i) for i in range(2)]
            rows, pairs = np.ones((2, 3), np.float32), np.ones((2, 2))
            message.sections.later = section(3, ["a", "ö"], np.eye(4), rows, pairs, poses, "end")
            longer = message.encode()
            reader = wire.Reader(longer)
            again = newer.read(reader)
            reader.finish()
            self.assertEqual(again.encode(), longer)
            self.assertEqual((again.sections.later.names, again.sections.later.pairs.shape), (["a", "ö"], (2, 2)))
            self.assertEqual(again.sections.later.poses[1].poses[0].tick, 1)
            reader = wire.Reader(longer)
            skipped = today.read(reader)
            reader.finish()
            self.assertEqual(skipped.encode(), body)
            self.assertIn(f"export interface {newer.__name__}Later {{", self.scripts)
            tried += 1
        self.assertGreaterEqual(tried, 11)


def number(value):
    return float(value) if isinstance(value, str) else value  # "inf", "-inf", "nan"


def vector(values):
    return np.array([number(value) for value in values], dtype=float)


def model_of(fields):
    vectors = ("reference_tip", "contact_point", "axis", "lateral_n")
    return brachyd.LocalModel(**{key: vector(value) if key in vectors else number(value)
                                 for key, value in fields.items()})


def same_bits(ours, theirs):
    return np.asarray(ours, dtype=np.float64).tobytes() == vector(theirs).tobytes()


class ForceVectors(unittest.TestCase):
    """tests/haptics/local_model_vectors.json: what the C++ headers give, to the bit."""

    @classmethod
    def setUpClass(cls):
        file = ROOT / "tests/haptics/local_model_vectors.json"
        cls.vectors = json.loads(file.read_text(encoding="utf-8"))

    def test_local_force_is_the_headers(self):
        self.assertEqual(len(self.vectors["vectors"]), 21)
        for one in self.vectors["vectors"]:
            local = brachyd.LocalForce(number(one["max_force_n"]), number(one["max_stiffness_n_per_mm"]))
            for i, step in enumerate(one["steps"]):
                with self.subTest(one["name"], step=i):
                    result = step["result"]
                    if "model" in step:
                        taken = local.take(model_of(step["model"]), step["pose_stamp_ns"], step["now_ns"])
                        self.assertEqual(taken, result["taken"])
                    else:
                        tip = vector(step["tip"])
                        force = local.evaluate(tip, step["now_ns"])
                        self.assertTrue(same_bits(force, result["force_n"]), f"{force} is not {result['force_n']}")
                        self.assertEqual(local.flags, result["flags"])
                        if "moment_nmm" in result:
                            moment = np.cross(tip - vector(step["about"]), force)
                            self.assertLessEqual(np.abs(moment - vector(result["moment_nmm"])).max(), 1e-9)
                    if local.model is not None:
                        self.assertTrue(same_bits(local.model.contact_point, result["contact_point"]))

    def test_received_force_is_the_headers(self):
        self.assertEqual(len(self.vectors["received"]), 8)
        for one in self.vectors["received"]:
            received = brachyd.ReceivedForce(number(one["max_force_n"]))
            for i, step in enumerate(one["steps"]):
                with self.subTest(one["name"], step=i):
                    result = step["result"]
                    if "received_n" in step:
                        force = brachyd.Force(valid_ms=step["valid_ms"],
                                              flags=brachyd.ForceFlag.LATCHED if step["is_latched"] else 0)
                        force.forces.force_n = vector(step["received_n"])
                        self.assertEqual(received.take(force, step["now_ns"]), result["taken"])
                    if "lost" in step:
                        received.lose()
                    if "armed" in step:
                        received.arm()
                    self.assertTrue(same_bits(received.evaluate(step["now_ns"]), result["force_n"]))
                    self.assertEqual(received.is_latched, result["is_latched"])


class AnyForce(unittest.TestCase):
    """Whatever comes, the force is finite, within its limit, and changes by at most 0.5 N/ms."""
    NUMBERS = (0.0, -0.0, 5e-324, 1e308, -1e308, math.inf, -math.inf, math.nan)

    def any_number(self):
        kind = self.random.randrange(12)
        if kind < 2:
            return self.random.choice(self.NUMBERS)
        return self.random.uniform(-1e6, 1e6) if kind == 2 else self.random.uniform(-20, 20)

    def check(self, evaluate, limit, steps=8_000):
        last, last_ns, now, felt = np.zeros(3), None, 0, 0
        for _ in range(steps):
            now = min(now + self.random.randrange(2_000_000), 2**63 - 1)
            if self.random.randrange(100) == 0:
                now = self.random.randrange(-2**63, 2**63)
            force = evaluate(now)
            since = 0 if last_ns is None else min(max(now - last_ns, 0), 1_000_000)
            self.assertTrue(np.isfinite(force).all())
            self.assertLessEqual(np.linalg.norm(force), (limit if limit > 0 else 0) * (1 + 1e-12))
            self.assertLessEqual(np.linalg.norm(force - last), 0.5e-6 * since + 1e-12)
            last, last_ns, felt = force, now, felt + (np.linalg.norm(force) > 0.1)
        self.assertEqual(felt > steps / 50, limit > 0, "the test must reach the forces it is about")

    def setUp(self):
        self.random = random.Random(45)

    def test_local_force(self):
        for limit in (3.3, math.nan, -1.0, 0.0):
            local = brachyd.LocalForce(limit)

            def evaluate(now, own=local):
                if self.random.randrange(8) == 0:
                    axis = np.array([self.random.uniform(-1, 1), self.random.uniform(-1, 1), 1 + self.random.random()])
                    own.take(brachyd.LocalModel(
                        contact=self.random.randrange(8), axis=axis / math.sqrt(axis @ axis),
                        reference_tip=np.array([self.any_number() for _ in range(3)]),
                        contact_point=np.array([self.any_number() for _ in range(3)]),
                        axial_stiffness_n_per_mm=abs(self.any_number()), axial_min_n=-abs(self.any_number()),
                        axial_max_n=abs(self.any_number()), after_puncture_n=abs(self.any_number()),
                        lateral_n=np.array([self.any_number() for _ in range(3)]),
                        lateral_stiffness_n_per_mm=abs(self.any_number()), time_to_live_s=self.any_number()),
                        None, now)
                return own.evaluate([self.any_number() for _ in range(3)], now)
            self.check(evaluate, limit)

    def test_received_force(self):
        for limit in (3.3, math.nan, -1.0, 0.0):
            received = brachyd.ReceivedForce(limit)

            def evaluate(now, own=received):
                own.take_force([self.any_number() for _ in range(3)], self.random.choice([0, 20, 2**16 - 1]),
                               self.random.randrange(50) == 0, now)
                if self.random.randrange(20) == 0:
                    own.arm()
                return own.evaluate(now)
            self.check(evaluate, limit)


if __name__ == "__main__":
    unittest.main()
