"""The case "kills" of scripts/campaigns/faults.sh: kill -9 while an operator changes the plan and draws outlines, a
script asks for scores, and trains of seeds fall. What a client was told must be in the session's directory, and in the
next daemon."""
import contextlib
import os
import random
import re
import shutil
import struct
import subprocess
import threading
import time
import urllib.request

from attack import OPERATOR, connected, message, split_messages
from programs import BIN, Crowd, Daemon, Row, player, read, running
from request_kinds import CONTOUR, HELLO, IMAGE, PLAN, SCANNER
from request_kinds import circle, hello_body, image_plane, text_field

EXERCISE = "exercises/scenes/09_whole_implant.toml"
LIVE, FROZEN, EDITED = 1, 2, 3


class Instructor(threading.Thread):
    """An operator who deepens the plan's remaining needles by 0.1 mm over and over, and outlines a frozen image; keeps
    the newest change and the number of studies that the daemon has told it."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.peer = connected(port, "127.0.0.1")
        self.sequence, self.change, self.studies, self.begun = 0, 0, 0, []
        self.rest, self.frozen, self.due, self.left, self.asked = [], None, 0.0, b"", 0
        self.start()

    def send(self, kind, body):
        self.sequence += 1
        self.peer.sendall(message(kind, body, self.sequence))

    def run(self):
        with contextlib.suppress(OSError):
            self.send(HELLO, hello_body(OPERATOR, "instructor"))
            self.peer.settimeout(0.02)
            while True:
                if time.monotonic() > self.due:
                    self.ask()
                    self.due = time.monotonic() + 0.25
                with contextlib.suppress(TimeoutError):
                    data = self.peer.recv(1 << 18)
                    if not data:
                        return
                    self.take(data)

    def ask(self):
        nan, self.asked = [float("nan")] * 7, self.asked + 1
        freeze = LIVE if self.asked < 10 or self.asked % 8 == 0 else FROZEN  # the scanner takes a while to start
        self.send(SCANNER, struct.pack("<HHIQ7dHH", 1, freeze, 0, 0, *nan, 0, 0))
        if self.rest:
            needles = b"".join(
                struct.pack("<HHId", 0, 0, 0, depth + 0.1) + text_field(hole) + text_field(train)
                for depth, hole, train in self.rest
            )
            head = struct.pack("<HHId", EDITED, 0, self.change, 0.0) + text_field("")
            self.send(PLAN, head + struct.pack("<HH", len(self.rest), 0) + needles + bytes(4))
        if self.frozen:
            tick, plane = self.frozen
            points = [x for c, s in circle(40) for x in (40 + 15 * c, 30 + 10 * s)]
            outline = struct.pack("<iIQd", 0, 40, tick, float("nan")) + plane + struct.pack("<80d", *points)
            self.send(CONTOUR, struct.pack("<QHH", 0, 1, 0) + outline + bytes(4))

    def take(self, data):
        found, self.left = split_messages(self.left + data)
        for kind, body in found:
            if kind == PLAN:
                self.take_plan(body)
            elif kind == CONTOUR:
                self.studies += 1
            elif kind == IMAGE and struct.unpack_from("<2xH", body)[0] & 2:
                self.frozen = image_plane(body)

    def take_plan(self, body):
        self.change = struct.unpack_from("<4xI", body)[0]
        at = 18 + struct.unpack_from("<16xH", body)[0]
        count = struct.unpack_from("<H", body, at)[0]
        at += 4
        self.rest = []
        for _ in range(count):
            flags, depth = struct.unpack_from("<2xH4xd", body, at)
            at += 16
            texts = []
            for _ in range(2):
                size = struct.unpack_from("<H", body, at)[0]
                texts.append(body[at + 2 : at + 2 + size].decode())
                at += 2 + size
            if not flags & 1:
                self.rest.append((depth, *texts))


def ask_for_scores(port, stop):
    while not stop.wait(0.1):
        with contextlib.suppress(OSError):
            urllib.request.urlopen(f"http://127.0.0.1:{port}/exercise-result", timeout=2).read()


def kept(session):
    """Seeds, changes of the plan and studies in a session's directory."""

    def lines_of(name):
        path = f"{session}/{name}"
        return read(path).splitlines() if os.path.exists(path) else []

    changes = lines_of("plan_changes.csv")[1:]
    for row in changes:
        file = re.search(r"plan_change_\d+\.toml", row)[0]
        if not read(f"{session}/{file}").strip():
            raise RuntimeError(f"{file} is empty")
    return len(lines_of("seeds.csv")[1:]), len(changes), len(lines_of("volume_studies.jsonl"))


def kills(folder, short):
    """kill -9 in the middle of plan changes, volume studies, scores and seeds."""
    # A copy: what lies beside a scene is read, too.
    shutil.copytree("config", f"{folder}/config")
    scene, needles = f"{folder}/config/{EXERCISE}", f"{folder}/needles.csv"
    subprocess.run(
        [BIN + "brachy", "plan", "--force", "--config", scene, "--trajectory", needles],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    count, moments = (2 if short else 20), random.Random(3)
    lost, told_all = [], [0, 0, 0]
    for i in range(count):
        work = f"{folder}/{i}"
        session = f"{work}/session"
        os.makedirs(work)
        stop = threading.Event()
        with running(Daemon(work, "--session", session, "--http-port", "0", scene=scene)) as daemon, running(
            player(daemon, work, needles, "--speed", "4")
        ):
            crowd = Crowd(work, daemon, "--surface", viewers=1, seconds=100)
            with running(crowd.process):
                crowd.ready()
                instructor = Instructor(daemon.port)
                threading.Thread(target=ask_for_scores, args=(daemon.http_port, stop), daemon=True).start()
                time.sleep(moments.uniform(4, 14))
                daemon.process.kill()
                instructor.join(10)
                told = (crowd.stop()["seeds"], instructor.change, instructor.studies)
            stop.set()
        found = kept(session)
        with running(Daemon(work, "--session", session, "--http-port", "0", scene=scene, name="again")) as daemon:
            again = Instructor(daemon.port)
            time.sleep(1)
            resumed = again.change
            daemon.end()
        told_all = [a + b for a, b in zip(told_all, told)]
        if any(f < t for f, t in zip(found, told)) or resumed < told[1]:
            lost.append(f"{work}: told {told}, kept {found}, the next daemon's change {resumed}")
    seeds, changes, studies = told_all
    return [
        Row(
            f"kill -9, {count} times",
            f"of {seeds} seeds, {changes} changes of the plan and {studies} volume studies that clients were told, "
            f"sessions lack some {len(lost)} times" + "".join("; " + each for each in lost[:2]),
            "0, and some of each were told",
            not lost and min(told_all) > 0,
        )
    ]
