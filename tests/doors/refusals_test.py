#!/usr/bin/env python3
"""Every refusal of a request, over every door that offers it, against a running brachyd: the code and the sentence are
the same, whoever carries the request. net/REFUSALS.md is the table of what was answered.

usage: tests/doors/refusals_test.py BRACHYD [--write]     exit code 1: doors differ, or the document does; 77: skipped
"""
import dataclasses
import http.client
import math
import os
import re
import sys
import time

from doors import (ANY_NEEDLE, ERRORS, NAN, ROOT, SCHEMA, SMALL, Daemon, IgtlDoor, NativeDoor, PythonDoor, Refused,
                   WebSocketDoor, igtl_message)

DOCUMENT = ROOT / "net/REFUSALS.md"
CODES = {number: name for name, number in ERRORS.items()}
NATIVE = (NativeDoor, WebSocketDoor, PythonDoor)
WITH_COMMANDS = SMALL + """[server]
igtl_commands = true
"""
PUNCTURE = SCHEMA.all["enums"]["EventKind"]["values"]["PUNCTURE"]
STAMP = 10**18  # of first poses, ns: any clock will do


def tip(x, y, z):
    return [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z]]


GOOD = tip(5, 0, -40)


@dataclasses.dataclass
class Row:
    request: str
    why: str
    code: int
    reason: int
    text: str
    doors: list  # their names, in order


class Table:
    def __init__(self):
        self.rows, self.differences = [], []

    def add(self, request, why, answers):
        """`answers`: the Refused, or None, by the door's name."""
        first = next(iter(answers.values()))
        for door, answer in answers.items():
            if answer is None:
                self.differences.append(f"{request}, {why}: {door} does not refuse")
                return
            got = (answer.code, steady(answer.text))
            expected = (first.code, steady(first.text))
            if request.startswith("POSE") and door.startswith("OpenIGTLink"):
                expected = (first.reason, expected[1])  # of poses it gives the reason
            if got != expected:
                self.differences.append(f"{request}, {why}: {door} says {got}, and {next(iter(answers))} {expected}")
        doors = [door + (f" (STATUS {answer.status})" if hasattr(answer, "status") else "")
                 for door, answer in answers.items()]
        self.rows.append(Row(request, why, first.code, first.reason, steady(first.text), doors))
        print(f"{request}, {why}: {first.text} [{', '.join(doors)}]", flush=True)

    def add_text(self, request, why, door, text):
        """What only one door offers, and answers in words of its own."""
        self.rows.append(Row(request, why, 0, 0, steady(text), [door]))
        print(f"{request}, {why}: {text} [{door}]", flush=True)


def person(role):
    return ("an " if role == "OPERATOR" else "a ") + role.lower()


def steady(text):
    """Without what another run has otherwise: addresses, ports and times."""
    text = re.sub(r"(OpenIGTLink )?127\.0\.0\.1:\d+", "ADDRESS", text)
    return re.sub(r"for \d+ s\b", "for N s", text)


class Cases:
    def __init__(self, program, table):
        self.program, self.table = program, table

    def daemon(self, scene, *more, **options):
        return Daemon(self.program, scene, *more, **options)

    def refused_hello(self, why, daemon, role, answers_of_others=None, **options):
        answers = {}
        for door in NATIVE:
            try:
                door(daemon, role, **options).close()
                answers[door.name] = None
            except Refused as refused:
                answers[door.name] = refused
        answers.update(answers_of_others or {})
        self.table.add(f"HELLO of {person(role)}", why, answers)

    def refused(self, why, daemon, role, kind, body, command=None, times=1):
        """One request over each door, and by `command` over OpenIGTLink, as a STRING and as a COMMAND. Of several
        times the last refusal counts."""
        answers = {}
        for make in NATIVE:
            door = make(daemon, role, 0 if role == "DEVICE" else ANY_NEEDLE)
            door.request(kind, body, times)
            answers[make.name] = self.of_burst(door, times)
            door.close()
        for as_command in (False, True) if command else ():
            door = IgtlDoor(daemon, as_command)
            door.command(command, times)
            answers[f"OpenIGTLink {'COMMAND' if as_command else 'STRING'} `{command}`"] = self.of_burst(door, times)
            door.close()
        self.table.add(f"{kind} of {person(role)}", why, answers)

    @staticmethod
    def of_burst(door, times):
        """Its only refusal, or the one that says "more than"."""
        if times == 1:
            return door.refusal()
        return door.refusals_until(lambda refused: refused is None or "more than" in refused.text)[-1]

    def refused_pose(self, why, daemon, poses, pause_s=0.0, igtl=True, role="DEVICE", needle=0, times=1):
        """The last of `poses` is refused; `pause_s` passes before it."""
        answers = {}
        for make in NATIVE + ((IgtlDoor,) if igtl else ()):
            door = make(daemon) if make is IgtlDoor else make(daemon, role, 0 if role == "DEVICE" else ANY_NEEDLE)
            for n, (X, stamp) in enumerate(poses):
                is_last = n + 1 == len(poses)
                if is_last and pause_s:
                    time.sleep(pause_s)
                door.pose(X, STAMP + stamp, needle, times if is_last else 1)
            answers[make.name] = door.refusal()
            door.close()
            self.until_free(daemon)
        self.table.add(f"POSE of {person(role)}", why, answers)

    @staticmethod
    def until_free(daemon, needle=0):
        """Until the daemon has seen that the needle's device left."""
        end = time.monotonic() + 60
        while True:
            try:
                NativeDoor(daemon, "DEVICE", needle).close()
                return
            except Refused as refused:
                assert time.monotonic() < end, refused.text

    # --- scenes ---

    def plain(self):
        """Two needles, no script, plan, probe or ultrasound."""
        scene = WITH_COMMANDS + "[needle]\ncount = 2\n[ultrasound]\non = false\n"
        with self.daemon(scene) as daemon:
            self.of_access(daemon)
            self.of_poses(daemon)
            self.of_needles(daemon)
            self.of_controls(daemon)
            self.of_what_is_missing(daemon)
            self.of_protocol(daemon)
            self.of_http(daemon)
            self.of_igtl(daemon)
            self.of_the_end(daemon)

    def of_access(self, daemon):
        def of_igtl(needle):
            door = IgtlDoor(daemon)
            door.pose(GOOD, STAMP, needle)
            refused = door.refusal()
            door.close()
            return {f"OpenIGTLink TRANSFORM of needle {needle}": refused}

        self.refused_hello("a needle that does not exist", daemon, "DEVICE", of_igtl(7), needle=7)
        holder = NativeDoor(daemon, "DEVICE", 0)
        self.refused_hello("the needle has a device", daemon, "DEVICE", of_igtl(0), needle=0)
        other = NativeDoor(daemon, "DEVICE", 1)
        self.refused_hello("every needle has a device", daemon, "DEVICE")
        holder.close()
        other.close()
        for needle in (0, 1):
            self.until_free(daemon, needle)

    def of_poses(self, daemon):
        scaled = [[2, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, -40]]
        late = 1_000_000
        self.refused_pose("NaN or infinity", daemon, [(tip(5, NAN, -40), 0)])
        self.refused_pose("beyond ±10 m", daemon, [(tip(5, 0, -40_000), 0)])
        self.refused_pose("no rotation", daemon, [(scaled, 0)])
        self.refused_pose("back in time", daemon, [(GOOD, 2 * late), (GOOD, late)])
        self.refused_pose("stale", daemon, [(GOOD, 0), (GOOD, late)], pause_s=0.2)
        self.refused_pose("too many a second", daemon, [(GOOD, 0)], times=600)
        self.refused_pose("another needle than WELCOME's", daemon, [(GOOD, 0)], igtl=False, needle=1)
        self.refused_pose("the sender is no device", daemon, [(GOOD, 0)], igtl=False, role="VIEWER")

    def of_needles(self, daemon):
        arm, press = {"needle": 9}, {"needle": 9, "pressed": 1}
        self.refused("a needle that does not exist", daemon, "OPERATOR", "ARM", arm, "arm 9")
        self.refused("another's needle", daemon, "DEVICE", "ARM", {"needle": 1})
        self.refused("no right", daemon, "VIEWER", "ARM", {"needle": 1})
        self.refused("too many a second", daemon, "OPERATOR", "ARM", {"needle": 0}, "arm 0", times=40)
        self.refused("a needle that does not exist", daemon, "OPERATOR", "DROP", press, "drop 9")
        device = NativeDoor(daemon, "DEVICE", 1)
        self.refused("another device has the needle", daemon, "OPERATOR", "DROP", {"needle": 1, "pressed": 1},
                     "drop 1")
        self.refused("another's needle", daemon, "DEVICE", "DROP", {"needle": 1, "pressed": 1})
        device.close()
        self.until_free(daemon, 1)
        self.refused("no right", daemon, "VIEWER", "DROP", {"needle": 0, "pressed": 1})
        self.drops_beyond_the_rate(daemon)

    def drops_beyond_the_rate(self, daemon):
        """Fatal. A command `drop` is two DROPs."""
        answers = {}
        for make in NATIVE:
            door = make(daemon, "DEVICE", 0)
            door.request("DROP", {"needle": 0, "pressed": 0}, 300)
            answers[make.name] = door.refusal()
            door.close()
            self.until_free(daemon)
        door = IgtlDoor(daemon)
        door.pose(GOOD, STAMP)  # it is the needle's device from here on
        door.command("drop 0", 63)
        answers["OpenIGTLink STRING `drop 0`"] = door.refusals_until(lambda r: r is None or "more than" in r.text)[-1]
        assert door.refusal() is None, "the connection ends"
        door.close()
        self.until_free(daemon)
        self.table.add("DROP of a device", "too many a second: fatal", answers)

    def of_controls(self, daemon):
        def control(action, kernel="", support="nan", flags=0):
            return {"action": action, "flags": flags, "support_radius_mm": support, "kernel": kernel}

        play, stop, reset, model = 1, 2, 3, 4
        for role in ("VIEWER", "DEVICE"):
            self.refused("no right", daemon, role, "CONTROL", control(reset))
        self.refused("no such action", daemon, "OPERATOR", "CONTROL", control(9))
        self.refused("no script to play", daemon, "OPERATOR", "CONTROL", control(play), "play")
        self.refused("no script to play over and over", daemon, "OPERATOR", "CONTROL", control(play, flags=1),
                     "play loop")
        self.refused("no script to stop", daemon, "OPERATOR", "CONTROL", control(stop), "stop")
        self.refused("no such kernel", daemon, "OPERATOR", "CONTROL", control(model, 'soft "<&"'))
        self.refused("no such kernel", daemon, "OPERATOR", "CONTROL", control(model, "soft"), "model soft")
        self.refused("no such support radius", daemon, "OPERATOR", "CONTROL", control(model, "psi31", -1.0),
                     "model psi31 -1")
        self.refused("too many a second", daemon, "OPERATOR", "CONTROL", control(stop), "stop", times=40)
        self.preparing(daemon, control(reset))

    def preparing(self, daemon, reset):
        """Of two RESETs at once the second is refused."""
        answers = {}
        for make in NATIVE:
            door = make(daemon, "OPERATOR")
            door.request("CONTROL", reset, 2)
            answers[make.name] = door.refusal()
            door.close()
            self.until_prepared(daemon)
        for as_command in (False, True):
            door = IgtlDoor(daemon, as_command)
            door.command("reset", 2)
            answers[f"OpenIGTLink {'COMMAND' if as_command else 'STRING'} `reset`"] = door.refusal()
            door.close()
            self.until_prepared(daemon)
        self.table.add("CONTROL of an operator", "another one is being prepared", answers)

    @staticmethod
    def until_prepared(daemon):
        door = NativeDoor(daemon, "VIEWER")
        end = time.monotonic() + 60
        while True:
            assert time.monotonic() < end, "the daemon still prepares a model"
            door.link.send([door.raw(6, b"")])  # a request for a STATE
            door.wait(lambda name, body: name == "STATE")
            if not door.sections["CONTROLS"]["flags"] & 8:
                door.close()
                return

    def of_what_is_missing(self, daemon):
        load, plan, scanner, contour, exercise = (load_of(0, 0), plan_of(2), SCANNER, contour_of([]),
                                                  {"file": "01_one_needle.toml", "trainee": ""})
        for kind, body in (("LOAD", load), ("PLAN", plan), ("SCANNER", scanner), ("CONTOUR", contour),
                           ("EXERCISE", exercise)):
            self.refused("no right", daemon, "VIEWER", kind, body)
        self.refused("a needle that does not exist", daemon, "OPERATOR", "LOAD", load_of(9, 0))
        self.refused("there is no plan", daemon, "OPERATOR", "LOAD", load)
        self.refused("there is no plan", daemon, "OPERATOR", "PLAN", plan)
        self.refused("no such request", daemon, "OPERATOR", "PLAN", plan_of(9))
        self.refused("there is no ultrasound", daemon, "OPERATOR", "SCANNER", scanner)
        self.refused("there is no ultrasound", daemon, "OPERATOR", "CONTOUR", contour)
        self.refused("not started for it", daemon, "OPERATOR", "EXERCISE", exercise)
        for kind, body in (("LOAD", load), ("PLAN", plan), ("SCANNER", scanner), ("CONTOUR", contour),
                           ("EXERCISE", exercise)):
            self.refused("too many a second", daemon, "OPERATOR", kind, body, times=60)

    def of_protocol(self, daemon):
        """What breaks the protocol ends the connection: whoever writes messages himself."""
        hello = "HELLO", {"role": 1, "subscription": 8, "max_force_n": "nan", "max_stiffness_n_per_mm": "nan",
                          "damping_n_s_per_mm": "nan", "rate_hz": "nan", "name": "again"}
        cases = [
            ("any message", "before HELLO", None, lambda door: door.raw(12, bytes(8))),
            ("HELLO", "a second one", "VIEWER", lambda door: door.encode(*hello)),
            ("HELLO", "a role that is none", None, lambda door: door.encode("HELLO", hello[1] | {"role": 9})),
            ("WELCOME", "only a server sends it", "VIEWER", lambda door: door.raw(2, bytes(60))),
            ("STATE", "not empty", "VIEWER", lambda door: door.raw(6, b"x")),
            ("any message", "of another version", "VIEWER", lambda door: door.raw(6, b"", version=2)),
            ("any message", "longer than max_message_bytes", "VIEWER", lambda door: door.raw(9, b"", length=1 << 20)),
            ("any message", "a sequence is left out", "VIEWER", lambda door: door.raw(6, b"", skipped=1)),
            ("any message", "bytes left over", "OPERATOR", lambda door: door.raw(13, bytes(40))),
        ]
        for request, why, role, made in cases:
            answers = {}
            for make in (NativeDoor, WebSocketDoor):
                door = make(daemon, role)
                door.link.send([made(door)])
                answers[make.name] = door.refusal()
                assert answers[make.name] and answers[make.name].fatal, why
                door.close()
            self.table.add(request, why, answers)

    def of_http(self, daemon):
        port = daemon.ports["http"]
        cases = [("GET /nothing", "no such page", {}), ("GET /exercise-report", "no report yet", {}),
                 ("GET /exercise-result", "no session is recorded", {}), ("POST /", "another method", {}),
                 ("GET /ws", "no upgrade", {}), ("GET /", "another Host", {"Host": "example.org"}),
                 ("GET /", "another page's Origin", {"Origin": "http://example.org"})]
        for request, why, headers in cases:
            status, text = http_answer(port, *request.split(), headers)
            self.table.add_text(request, why, f"HTTP ({status})", text)

    def of_igtl(self, daemon):
        def answer(data):
            door = IgtlDoor(daemon)
            door.send(data)
            refused = door.refusal()
            door.close()
            return refused

        string = b"\0\3\0\5dance"
        for request, why, data in (
                ("STRING `dance`", "no such command", igtl_message("STRING", "Test", string)),
                ("GET_TRANS `CameraToRas`", "no such transform",
                 igtl_message("GET_TRANS", "CameraToRas", b"", version=2)),
                ("GET_IMAGE", "there is no ultrasound", igtl_message("GET_IMAGE", "", b"")),
                ("STT_IMAGE", "there is no ultrasound", igtl_message("STT_IMAGE", "", b"")),
                ("STRING", "the wrong CRC", igtl_message("STRING", "Test", string, crc=1)),
                ("TRANSFORM", "a body of the wrong size", igtl_message("TRANSFORM", "Needle0ToRas", bytes(40))),
                ("any message", "no OpenIGTLink", b"GET / HTTP/1.1\r\n" + bytes(100))):
            refused = answer(data)
            self.table.add_text(request, why, f"OpenIGTLink (STATUS {refused.status})", refused.text)

    def of_the_end(self, daemon):
        doors = {make.name: make(daemon, "VIEWER") for make in NATIVE} | {"OpenIGTLink": IgtlDoor(daemon)}
        doors["OpenIGTLink"].command("arm 9")
        assert doors["OpenIGTLink"].refusal(), "it is connected"
        daemon.process.terminate()
        self.table.add("any connection", "the daemon ends", {name: door.refusal() for name, door in doors.items()})
        for door in doors.values():
            door.close()

    def planned(self):
        """A plan, a script, a probe and ultrasound."""
        scene = WITH_COMMANDS + f"""
[plan]
file = "{ROOT}/config/plan.toml"
[device]
trajectory = "{ROOT}/config/insertion.csv"
[probe]
on = true
[ultrasound]
on = true
"""
        with self.daemon(scene) as daemon:
            self.until_ticking(daemon)
            self.refused("the plan has no such needle", daemon, "OPERATOR", "LOAD", load_of(0, 999))
            self.refused("the probe", daemon, "OPERATOR", "LOAD", load_of(1, 0))
            self.refused("the probe", daemon, "OPERATOR", "DROP", {"needle": 1, "pressed": 1}, "drop 1")
            self.refused("the plan has changed", daemon, "OPERATOR", "PLAN", plan_of(3, change=7))
            needle = {"number": 0, "flags": 0, "first_seed": 0, "depth_mm": 80.0, "hole": "G5", "train": "ss"}
            for why, needles in (("no such hole", [needle | {"hole": "ZZ"}]),
                                 ("a hole twice", [needle, needle]),
                                 ("a depth that is not finite", [needle | {"depth_mm": math.inf}]),
                                 ("more needles than holes", [needle] * 400),
                                 ("a train that is none", [needle | {"train": "s?s"}])):
                self.refused(why, daemon, "OPERATOR", "PLAN", plan_of(3, needles=needles))
            self.of_scanner(daemon)
            X_WI = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]
            outline = {"slice": 0, "tick": 999_999, "probe_depth_mm": 0.0, "X_WI": X_WI,
                       "points": [[1.0, 1.0], [5.0, 1.0], [5.0, 5.0]]}
            self.refused("no outline", daemon, "OPERATOR", "CONTOUR", contour_of([]))
            self.refused("a tick of which no image was frozen", daemon, "OPERATOR", "CONTOUR", contour_of([outline]))
            self.igtl_images(daemon)
            play = {"action": 1, "flags": 0, "support_radius_mm": "nan", "kernel": ""}
            device = NativeDoor(daemon, "DEVICE", 0)
            self.refused("the needle has a device", daemon, "OPERATOR", "CONTROL", play, "play")
            self.in_the_tissue(daemon, device)
            device.close()

    def of_scanner(self, daemon):
        for why, change in (("no such array", {"array": 9}), ("no such freeze", {"freeze": 9}),
                            ("depth", {"depth_mm": 500.0}), ("gain", {"gain_db": 99.0}),
                            ("dynamic range", {"dynamic_range_db": 1.0}),
                            ("time gain compensation", {"tgc_extra_db_per_cm": math.inf}),
                            ("focus", {"focus_mm": 1.0}), ("the stepper's depth", {"probe_depth_mm": 999.0}),
                            ("the stepper's rotation", {"probe_rotation_deg": 999.0})):
            self.refused(why, daemon, "OPERATOR", "SCANNER", SCANNER | change)
        probe = NativeDoor(daemon, "DEVICE", 1)
        self.refused("a device has the probe", daemon, "OPERATOR", "SCANNER", SCANNER | {"probe_depth_mm": 5.0})
        probe.close()
        self.until_free(daemon, 1)

    def igtl_images(self, daemon):
        for name, why in (("UltrasoundSagittal", "an array that is not in use"), ("Camera", "no such image")):
            door = IgtlDoor(daemon)
            door.send(igtl_message("GET_IMAGE", name, b""))
            refused = door.refusal()
            door.close()
            self.table.add_text(f"GET_IMAGE `{name}`", why, f"OpenIGTLink (STATUS {refused.status})", refused.text)

    def in_the_tissue(self, daemon, device):
        """A plan is not changed while a needle is in the tissue. The device puts it there: a pose for each STATE, which
        come when they come."""
        punctures = []

        def is_state(name, body):
            if name == "EVENT" and body["kind"] == PUNCTURE:
                punctures.append(body)
            return name == "STATE"

        depth, end = -50.0, time.monotonic() + 60
        while not punctures:
            assert time.monotonic() < end, "the needle does not get in"
            for _ in range(20):
                depth = min(depth + 1, 10)
                device.pose(tip(5, 0, depth), time.monotonic_ns())
                time.sleep(0.01)  # a few ticks each
            device.link.send([device.raw(6, b"")])
            device.wait(is_state, lambda error: False)
        self.refused("a needle is in the tissue", daemon, "OPERATOR", "PLAN", plan_of(2))

    @staticmethod
    def until_ticking(daemon):
        """Until there is a snapshot: before it a plan is not changed."""
        door = NativeDoor(daemon, "VIEWER")
        end = time.monotonic() + 60
        while True:
            assert time.monotonic() < end, "the daemon does not tick"
            door.link.send([door.raw(6, b"")])
            if door.wait(lambda name, body: name == "STATE")["snapshots"] > 1:
                return door.close()

    def others(self):
        reset = {"action": 3, "flags": 0, "support_radius_mm": "nan", "kernel": ""}
        model = reset | {"action": 4, "kernel": "psi31"}
        with self.daemon(WITH_COMMANDS, "--session", "{folder}/session") as daemon:
            self.refused("a session is recorded", daemon, "OPERATOR", "CONTROL", reset, "reset")
            self.refused("a session is recorded", daemon, "OPERATOR", "CONTROL", model, "model psi31")
        bending = WITH_COMMANDS + "[needle]\nflexible = true\n"
        with self.daemon(bending) as daemon:
            self.refused("a model that the scene cannot take", daemon, "OPERATOR", "CONTROL", model, "model psi31")
        with self.daemon(SMALL) as daemon:
            answers = {}
            for as_command in (False, True):
                door = IgtlDoor(daemon, as_command)
                door.command("reset")
                answers[f"OpenIGTLink {'COMMAND' if as_command else 'STRING'} `reset`"] = door.refusal()
                door.close()
            self.table.add("CONTROL", "the scene takes no commands", answers)
        hdr = WITH_COMMANDS + f"""
[needle]
count = 18
[implant]
kind = "hdr"
[plan]
file = "{ROOT}/config/hdr_plan.toml"
[dose]
prescription_gy = 13.5
"""
        with self.daemon(hdr) as daemon:
            self.refused("an afterloader's catheters", daemon, "OPERATOR", "PLAN", plan_of(2))
            self.refused("an afterloader's catheters", daemon, "OPERATOR", "LOAD", load_of(0, 0))
        scene = ROOT / "config/exercises/scenes/01_one_needle.toml"
        with self.daemon("", "--sessions", "{folder}/sessions", config=scene) as daemon:
            self.refused("no such exercise", daemon, "OPERATOR", "EXERCISE", {"file": "../plan.toml", "trainee": ""})
        self.with_tokens()
        self.without_a_slot()

    def with_tokens(self):
        tokens = {name: os.urandom(32) for name in ("all", "viewer")}
        scene = WITH_COMMANDS + 'token_file = "all.token"\nviewer_token_file = "viewer.token"\n'
        files = {f"{name}.token": token for name, token in tokens.items()}
        with self.daemon(scene, files=files, igtl=False) as daemon:
            def by_http(token):
                headers = {"Authorization": f"Bearer {token.hex()}"} if token else {}
                status, text = http_answer(daemon.ports["http"], "GET", "/metrics", headers)
                return {f"HTTP ({status})": Refused(ERRORS["UNAUTHORISED"], 0, text)}  # the status is its code

            unknown = os.urandom(32)
            self.refused_hello("no token", daemon, "VIEWER", by_http(None))
            self.refused_hello("an unknown token", daemon, "VIEWER", by_http(unknown), token=unknown)
            self.refused_hello("a token for another role", daemon, "OPERATOR", token=tokens["viewer"])

    def without_a_slot(self):
        with self.daemon(WITH_COMMANDS + "max_clients = 1\n") as daemon:
            door = NativeDoor(daemon, "VIEWER")
            igtl = IgtlDoor(daemon)
            status, text = http_answer(daemon.ports["http"], "GET", "/", {})
            self.refused_hello("no slot is free", daemon, "VIEWER",
                               {"OpenIGTLink, at the connection": igtl.refusal(),
                                f"HTTP ({status})": Refused(ERRORS["BUSY"], 0, text)})
            igtl.close()
            door.close()


def http_answer(port, method, path, headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    text = answer.read().decode().strip()
    connection.close()
    return answer.status, text


def load_of(needle, plan_needle):
    return {"needle": needle, "plan_needle": plan_needle}


def plan_of(kind, change=0, needles=()):
    return {"kind": kind, "flags": 0, "change": change, "air_kerma_strength_u": 0.0, "by": "", "needles": list(needles)}


def contour_of(slices):
    return {"about_sequence": 0, "slices": slices}


SCANNER = {"array": 0, "freeze": 0, "flags": 0, "tick": 0} | dict.fromkeys(
    ("depth_mm", "gain_db", "dynamic_range_db", "tgc_extra_db_per_cm", "focus_mm", "probe_depth_mm",
     "probe_rotation_deg"), "nan")

HEAD = """# Refusals

Generated by `tests/doors/refusals_test.py BRACHYD --write`, which makes each of these requests over each door that
offers it and compares what is answered: the code and the sentence are the same, since one place decides
([requests](requests/request.h), the daemon's handlers, the guard of poses) and doors only carry. Doors: the native
protocol over TCP and WebSocket ([PROTOCOL.md](PROTOCOL.md)), `brachyd.Client` in [Python](../apps/python/README.md),
[OpenIGTLink](IGTL.md) and [HTTP](PROTOCOL.md#http). A code is that of ERROR; of a pose the reason follows it.
OpenIGTLink's STATUS has its own code, given here, and the one of this table, of a pose the reason, as its sub-code; a
COMMAND's answer has it in its content.

"""
FOOT = """
Not in the table, since they need a broker, or seconds of silence: a view-only relay (NOT_DEVICE, NOT_OPERATOR),
TIMEOUT, and a plan that changed or a model that failed while it was made. The client in C has the native protocol's
codes and texts.
"""


def document(rows):
    lines = ["| request | why | code | answer | over |", "|---|---|---|---|---|"]
    for row in rows:
        code = f"{row.code} {CODES[row.code]}" if row.code in CODES else "–"
        if row.reason:
            code += f", {row.reason:x}" if row.reason >= 0xff00 else f", {row.reason}"
        text = row.text.replace("|", "\\|").replace("<", "&lt;")
        lines.append(f"| {row.request} | {row.why} | {code} | {text} | {', '.join(row.doors)} |")
    return HEAD + "\n".join(lines) + "\n" + FOOT


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--write"]):
        sys.exit(__doc__)
    table = Table()
    cases = Cases(os.path.abspath(sys.argv[1]), table)
    cases.plain()
    cases.planned()
    cases.others()
    for difference in table.differences:
        print(f"DIFFERENT  {difference}")
    text = document(table.rows)
    if sys.argv[2:]:
        DOCUMENT.write_text(text, encoding="utf-8")
    elif not DOCUMENT.exists() or DOCUMENT.read_text(encoding="utf-8") != text:
        is_stale = "net/REFUSALS.md is not what was answered: tests/doors/refusals_test.py BRACHYD --write"
        table.differences.append(is_stale)
        print(is_stale)
    print(f"{len(table.rows)} refusals, {len(table.differences)} differences")
    sys.exit(1 if table.differences else 0)


if __name__ == "__main__":
    main()
