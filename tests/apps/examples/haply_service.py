#!/usr/bin/env python3
"""The Haply adapter against a service that speaks as Haply's: WebSocket, JSON, one state for each message, metres.

A hand goes 44 mm in, meets the tissue, and the daemon is killed. Prints the cycles' jitter and how long a force stood.

usage: tests/apps/examples/haply_service.py HAPLY_DEVICE BRACHYD
"""
import base64
import hashlib
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../../python"))
sys.path.insert(0, os.path.join(HERE, "../../../apps/python"))
try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is missing")
    sys.exit(77)
import brachyd  # pylint: disable=wrong-import-position
from waiting import DEADLINE_S, wait_until  # pylint: disable=wrong-import-position

if len(sys.argv) < 3:
    sys.exit(__doc__)
HAPLY_DEVICE, BRACHYD = (os.path.abspath(program) for program in sys.argv[1:3])
SCENE = '[tissue]\npoints = 1200\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n'
DEVICE = "049D"


class Service:
    """One client at a time; refuses what is not of its dialect. `disturb`, if any, gets the answer to each message and
    returns the messages to send instead, which may be none, or None to end the connection."""

    def __init__(self, dialect, device=DEVICE):
        self.dialect, self.device = dialect, device
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        self.at_m = [0.0, 0.1, 0.2]
        self.cycles, self.mistakes = [], []  # (time, force)
        self.is_pressed = False
        self.connections = 0
        self.disturb = lambda answer: [answer]
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def close(self):
        self.listener.close()

    def serve(self):
        while True:
            try:
                peer, _ = self.listener.accept()
            except OSError:
                return
            self.connections += 1
            try:
                with peer, peer.makefile("rb") as self.stream:
                    self.talk(peer)
            except OSError:
                pass

    def talk(self, peer):
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        request = b""
        while not request.endswith(b"\r\n\r\n"):
            line = self.stream.readline()
            if not line:
                return
            request += line
        key = re.search(rb"Sec-WebSocket-Key: (\S+)", request, re.I)[1]
        accept = base64.b64encode(hashlib.sha1(key + b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11").digest())
        peer.sendall(b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                     b"Sec-WebSocket-Accept: " + accept + b"\r\n\r\n")
        peer.sendall(self.frame(self.state(first=True)))
        while (message := self.read()) is not None:
            self.take(json.loads(message))
            answers = self.disturb(self.state())
            if answers is None:
                return
            for answer in answers:
                peer.sendall(self.frame(answer))

    def read(self):
        head = self.stream.read(2)
        if len(head) < 2 or head[0] & 15 == 8:
            return None
        size = head[1] & 127
        if size == 126:
            size = struct.unpack(">H", self.stream.read(2))[0]
        mask = self.stream.read(4)
        body = self.stream.read(size)
        return bytes(byte ^ mask[i % 4] for i, byte in enumerate(body))

    @staticmethod
    def frame(message):
        data = message if isinstance(message, bytes) else json.dumps(message).encode()
        length = bytes([len(data)]) if len(data) < 126 else b"\x7e" + struct.pack(">H", len(data))
        return b"\x81" + length + data

    def state(self, first=False):
        x, y, z = self.at_m
        device = {"device_id": self.device, "state": {"cursor_position": {"x": x, "y": y, "z": z},
                                                 "cursor_velocity": {"x": 0.0, "y": 0.0, "z": 0.0}}}
        if first:
            device["config"] = {"handedness": "right"}
        return {"inverse3": [device], "verse_grip": [],
                "wireless_verse_grip": [{"device_id": "61576", "state": {"buttons": {"a": self.is_pressed}}}]}

    def take(self, message):
        try:
            command = message["inverse3"][0]
            force = command["commands"]["set_cursor_force"][self.dialect]
            if command["device_id"] != self.device or set(force) != {"x", "y", "z"}:
                raise KeyError(str(command))
            self.cycles.append((time.monotonic(), [force[axis] for axis in "xyz"]))
        except (KeyError, IndexError) as error:
            self.mistakes.append(repr(error))


def size(force):
    return sum(x * x for x in force) ** 0.5


class Haply(unittest.TestCase):
    def wait_for(self, condition):
        wait_until(lambda: condition() or self.adapter.poll() is not None)

    def start_daemon(self, folder):
        """The process, and its HOST:PORT."""
        with open(f"{folder}/s.toml", "w", encoding="ascii") as file:
            file.write(SCENE)
        line = [BRACHYD, "--port", "0", "--config", f"{folder}/s.toml", "--duration", str(2 * DEADLINE_S)]
        daemon = subprocess.Popen(line, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(daemon.wait)
        self.addCleanup(daemon.kill)
        self.addCleanup(daemon.stdout.close)
        return daemon, daemon.stdout.readline().split()[-1]

    def play(self, dialect):
        """None: no force came, or it did not stay. Where adapter or daemon stand still for 50 ms, as they may beside
        busy programs, the force is taken away."""
        with tempfile.TemporaryDirectory() as folder:
            daemon, address = self.start_daemon(folder)
            service = Service(dialect)
            line = [HAPLY_DEVICE, address, "--service", service.address, "--dialect", dialect]
            adapter = self.adapter = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.addCleanup(adapter.kill)
            self.wait_for(lambda: len(service.cycles) > 200)
            for _ in range(440):  # 44 mm away from the user: 5 mm into the gland
                service.at_m[1] += 0.0001
                self.wait_for(lambda seen=len(service.cycles): len(service.cycles) > seen)
            self.wait_for(lambda seen=len(service.cycles): size(service.cycles[-1][1]) > 0.5
                          or len(service.cycles) > seen + 5000)
            self.wait_for(lambda seen=len(service.cycles): len(service.cycles) > seen + 500)
            force = service.cycles[-1][1]
            if adapter.poll() is not None or size(force) <= 0.5:
                daemon.kill()
                return None
            killed = time.monotonic()
            daemon.kill()
            out, err = adapter.communicate(timeout=DEADLINE_S)
            last = max(when for when, f in service.cycles if size(f) > 0)
            print(f"{dialect}: {out.splitlines()[0]}; a force of {size(force):.2f} N was 0 "
                  f"{1e3 * (last - killed):.1f} ms after the daemon was killed", flush=True)
            return service, adapter.returncode, force, err

    def check(self, dialect):
        played = next(filter(None, (self.play(dialect) for _ in range(10))), None)
        self.assertIsNotNone(played, "no force in ten plays")
        service, code, force, err = played
        self.assertEqual(service.mistakes, [])
        self.assertLess(force[1], -0.5, "the tissue pushes back towards the user")
        self.assertEqual(size(service.cycles[-1][1]), 0.0, "0 N is the last that the service is told")
        self.assertEqual(code, 1)
        self.assertIn("the daemon is gone", err)
        forces = [size(f) for _, f in service.cycles]
        self.assertLess(max(abs(b - a) for a, b in zip(forces, forces[1:])), 0.5 + 1e-9)

    def test_vector(self):
        self.check("vector")

    def test_values(self):
        self.check("values")

    def start(self, service, *more):
        """Daemon, adapter and a viewer that sees the needle."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        _, address = self.start_daemon(folder.name)
        self.addCleanup(service.close)
        line = [HAPLY_DEVICE, address, "--service", service.address, *more]
        adapter = self.adapter = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(adapter.communicate)
        self.addCleanup(adapter.kill)
        viewer = self.viewer = brachyd.Client(address, timeout_s=DEADLINE_S)
        self.addCleanup(viewer.close)

    def pose(self):
        """Of the needle, as the newest FRAME has it; None: it is not there."""
        self.viewer.poll(0.001)
        needles = self.viewer.protocol.frame.needles if self.viewer.protocol.frame else []
        return needles[0].X_WN if needles and self.adapter.poll() is None else None

    def wait_for_tip(self, tip):
        wait_until(lambda: self.adapter.poll() is not None or (
            (X := self.pose()) is not None and np.abs(X[:3, 3] - tip).max() < 1e-6))
        X = self.pose()
        self.assertIsNotNone(X, "the adapter has ended, or the needle is not there")
        self.assertTrue(np.array_equal(X[:3, :3], np.eye(3)), "it points along the world's +z")

    def test_right_up_and_in_are_the_screens(self):
        """The physician looks from the feet: the patient's right, +x, is on the screen's left."""
        service = Service("vector")
        self.start(service)
        tip = np.array([0.0, 0.0, -60.0])
        self.wait_for_tip(tip)
        for axis, step in ((0, [-1, 0, 0]), (2, [0, 1, 0]), (1, [0, 0, 1])):  # Haply's right, up, away from the user
            for _ in range(10):  # steps that are no jump
                service.at_m[axis] += 0.0005
                tip = tip + 0.5 * np.array(step)
                self.wait_for_tip(tip)

    def test_what_is_late_foreign_or_damaged_ends_nothing(self):
        service = Service("vector", device=1180)  # a number
        self.start(service)
        tip = np.array([0.0, 0.0, -60.0])
        self.wait_for_tip(tip)
        late = []

        def is_late(answer):
            time.sleep(0.03)  # the adapter waits 20 ms
            return [answer]

        def comes_with_the_next(answer):
            late.append(answer)
            return [late.pop(0)] if len(late) > 1 else []

        other = {"device_id": "OTHER", "state": {"cursor_position": {"x": 9, "y": 9, "z": 9}}}
        foreign = [{"session": {"id": 7}}, {"inverse3": 5}, {"inverse3": [5, None, {}, {"device_id": None}]}, [], "x",
                   3, b"{ no JSON", {"inverse3": [other]},
                   {"inverse3": [{"device_id": 1180, "state": {"cursor_position": {"x": "a", "y": None}}}]},
                   {"inverse3": [{"device_id": 1180, "state": {"cursor_position": 3}}], "verse_grip": 3},
                   {"inverse3": {"device_id": {"a": 1}}}]
        for disturb in (is_late, comes_with_the_next, lambda answer: foreign + [answer],
                        lambda answer: [answer] + foreign, lambda answer: [answer] * 3):
            service.disturb = disturb
            service.at_m[1] += 0.001
            tip = tip + [0, 0, 1]
            self.wait_for_tip(tip)
        self.assertEqual(service.mistakes, [])
        self.assertEqual(service.connections, 1)

    def test_a_device_or_a_service_that_comes_back_is_taken_back_where_the_needle_is(self):
        service = Service("vector")
        self.start(service)
        tip = np.array([0.0, 0.0, -60.0])
        self.wait_for_tip(tip)
        for is_service in (False, True):
            seen = len(service.cycles)
            gone = time.monotonic() + 1
            service.disturb = lambda answer: None if is_service else [{**answer, "inverse3": []}]
            while time.monotonic() < gone:
                self.assertIsNone(self.adapter.poll(), "it waits")
                time.sleep(0.01)
            self.assertGreater(len(service.cycles), seen)
            service.at_m = [0.3, -0.2, 0.5]  # elsewhere meanwhile: no jump
            service.disturb = lambda answer: [answer]
            # The needle is still where it was: the adapter must have seen the hand where it is now.
            self.wait_for(lambda seen=len(service.cycles): len(service.cycles) > seen + 50)
            self.wait_for_tip(tip)
            service.at_m[1] += 0.002
            tip = tip + [0, 0, 2]
            self.wait_for_tip(tip)
        self.assertGreater(service.connections, 1)
        self.adapter.send_signal(signal.SIGTERM)
        _, err = self.adapter.communicate(timeout=DEADLINE_S)
        self.assertIn("the device sends no state", err)
        self.assertIn("the service is there again", err)
        self.assertEqual(self.adapter.returncode, 0, err)

    def test_a_service_that_is_not_there_is_named(self):
        for more in (["--service", "127.0.0.1:1"], ["--dialect", "tensor"], ["--dialect"]):
            done = subprocess.run([HAPLY_DEVICE, "127.0.0.1:1", *more], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr, r"no Haply service at 127\.0\.0\.1:1|usage: haply_device")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
