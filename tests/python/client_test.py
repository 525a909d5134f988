#!/usr/bin/env python3
"""apps/python against a running brachyd: viewers, devices, operators, tokens, TLS, reconnecting; and installed by pip.

usage: tests/python/client_test.py BRACHYD BRACHY     exit code 77: skipped, with its reason
"""
import asyncio
import os
import pathlib
import re
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "apps/python"))
try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is missing")
    sys.exit(77)

import brachyd
from brachyd import ControlAction, ErrorCode, Hello, Role, Subscription, unit_pose
from brachyd.constants import ForceFlag
from waiting import DEADLINE_S, wait_until

if len(sys.argv) < 3:
    sys.exit(__doc__)
BRACHYD, BRACHY = (os.path.abspath(program) for program in sys.argv[1:3])


class Daemon:
    """brachyd on a free port, ended with the test."""

    def __init__(self, folder, *more):
        self.process = subprocess.Popen([BRACHYD, "--port", "0", "--duration", str(2 * DEADLINE_S), *more], cwd=folder,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        found = re.match(r"brachyd listening on (.*:\d+)$", line)
        if not found:
            raise AssertionError(f"brachyd's first line: {line}{self.process.stderr.read()}")
        self.address = found[1]
        self.http = ""
        if "--http-port" in more:
            self.http = self.process.stdout.readline().split()[-1]

    def end(self):
        self.process.terminate()
        return self.process.communicate(timeout=DEADLINE_S)[1]


class WithDaemon(unittest.TestCase):
    options = ()

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.daemon = Daemon(self.folder.name, *self.options)
        self.addCleanup(self.daemon.end)

    def client(self, **hello):
        client = brachyd.Client(self.daemon.address, Hello(**hello), timeout_s=DEADLINE_S)
        self.addCleanup(client.close)
        return client


class Viewing(WithDaemon):
    def test_changes_and_whole_frames_make_the_same_mesh(self):
        changes = self.client(subscription=Subscription.SCENE)
        whole = self.client(subscription=Subscription.FULL_FRAMES)
        device = self.client(role=Role.DEVICE, subscription=Subscription.NO_MESH)
        changes.wait_for(lambda: changes.protocol.frame is not None and changes.protocol.scene is not None, DEADLINE_S)
        self.assertIn("psi31", changes.protocol.scene.kernels)
        meshes, compared, depth = ({}, {}), 0, -60.0

        def compare():
            nonlocal compared, depth
            depth = min(depth + 0.5, 10.0)
            device.send_pose(unit_pose([5, 0, depth]))
            device.poll()
            for client, kept in zip((changes, whole), meshes):
                # The positions are those of the last frame, of however many have come.
                frames = [message for message in client.poll(0.01) if isinstance(message, brachyd.Frame)]
                if frames and frames[-1].max_displacement_mm > 0:
                    kept[frames[-1].tick] = client.protocol.positions.copy()
            for tick in meshes[0].keys() & meshes[1].keys():
                self.assertTrue(np.array_equal(meshes[0].pop(tick), meshes[1].pop(tick)))
                compared += 1

        wait_until(lambda: compared >= 30, compare)

    def test_the_mesh_is_the_cpp_clients_bit_for_bit(self):
        device = self.client(role=Role.DEVICE, subscription=Subscription.NO_MESH)
        viewer = self.client()
        for depth in np.arange(-40.0, 0.0, 0.5):
            device.send_pose(unit_pose([5, 0, depth]))
            device.poll(0.005)
        meshes = {}

        def hold():
            device.send_pose(unit_pose([5, 0, 0]))
            device.poll(0.02)
            viewer.poll()
            frame = viewer.protocol.frame
            if frame is not None and frame.max_displacement_mm > 0:
                meshes[frame.tick] = viewer.protocol.positions.copy()

        def is_at_rest():
            newest = [meshes[tick] for tick in sorted(meshes)[-3:]]
            return len(newest) == 3 and all(np.array_equal(mesh, newest[0]) for mesh in newest)

        wait_until(is_at_rest, hold)  # then it does not matter which frame either of the two has seen last
        out = pathlib.Path(self.folder.name) / "series"
        line = [BRACHY, "record", "--connect", self.daemon.address, "--out", str(out), "--duration", "1.5"]
        record = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        while record.poll() is None:
            hold()
        self.assertEqual(record.returncode, 0, record.stderr.read())
        record.stderr.close()
        self.assertGreater(viewer.protocol.frame.max_displacement_mm, 0)
        last = sorted(out.glob("*.vtp"))[-1].read_bytes()
        header, _, data = last.partition(b'<AppendedData encoding="raw">\n_')
        points = re.search(rb"<Points>.*?offset=\"(\d+)\"", header, re.S)
        at = int(points[1]) + 8
        count = len(viewer.protocol.positions)
        mesh = np.frombuffer(data[at:at + 12 * count], "<f4").reshape(-1, 3)
        self.assertTrue(np.array_equal(mesh, viewer.protocol.positions))

    def test_asyncio_follows_it_too(self):
        async def follow():
            client = await brachyd.AsyncClient.connect(self.daemon.address)
            frames = 0
            async for message in client:
                frames += isinstance(message, brachyd.Frame)
                if frames >= 5:
                    break
            await client.close()
            return client.protocol

        protocol = asyncio.run(asyncio.wait_for(follow(), DEADLINE_S))
        self.assertGreaterEqual(protocol.mesh_tick, 1)
        self.assertEqual(len(protocol.positions), len(protocol.topology.rest))

    def test_asyncio_goes_on_after_a_break_and_answers_pings(self):
        async def follow():
            async with await brachyd.AsyncClient.connect(self.daemon.address) as client:
                ticks, end = [], time.monotonic() + 8  # longer than a silent client is kept
                while time.monotonic() < end:
                    async for message in client:
                        if isinstance(message, brachyd.Frame):
                            ticks.append(message.tick)
                            break
                await client.control(ControlAction.RESET)
                async for message in client:
                    if client.errors:
                        return ticks, client.errors

        ticks, errors = asyncio.run(asyncio.wait_for(follow(), DEADLINE_S))
        self.assertEqual(ticks, sorted(set(ticks)), "no message comes twice")
        self.assertGreater(len(ticks), 20)
        self.assertEqual(errors[0].code, ErrorCode.NOT_OPERATOR)

    def test_asyncio_does_not_wait_for_ever(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            with self.assertRaises(asyncio.TimeoutError):
                asyncio.run(brachyd.AsyncClient.connect("127.0.0.1:%d" % silent.getsockname()[1], timeout_s=0.1))

    def test_the_plan_that_was_subscribed_to_is_there(self):
        scene = pathlib.Path(self.folder.name) / "s.toml"
        scene.write_text(f'[plan]\nfile = "{ROOT}/config/plan.toml"\n')
        daemon = Daemon(self.folder.name, "--config", str(scene))
        self.addCleanup(daemon.end)
        with brachyd.Client(daemon.address, Hello(subscription=Subscription.PLAN), timeout_s=DEADLINE_S) as viewer:
            viewer.wait_for(lambda: viewer.protocol.plan is not None, DEADLINE_S)
            self.assertGreater(len(viewer.protocol.plan.needles), 10)

    def test_a_recording_is_what_was_sent(self):
        file = pathlib.Path(self.folder.name) / "r.brachy"
        subprocess.run([BRACHY, "record", "--connect", self.daemon.address, "--out", str(file), "--duration", "0.5"],
                       check=True, capture_output=True)
        recording = brachyd.Recording(file)
        messages = [message for _, message in recording]
        self.assertEqual(recording.end, "")
        self.assertIsInstance(messages[0], brachyd.Welcome)
        frames = [message for message in messages if isinstance(message, brachyd.Frame)]
        self.assertTrue(frames[0].is_full)
        cut = pathlib.Path(self.folder.name) / "cut.brachy"
        cut.write_bytes(file.read_bytes()[:-3])
        shorter = brachyd.Recording(cut)
        self.assertEqual(len(list(shorter)), len(messages) - 1)
        self.assertIn("cut off at byte", shorter.end)


class OverWebSocket(WithDaemon):
    options = ("--http-port", "0")

    def test_both_clients_speak_it(self):
        with brachyd.Client(f"ws://{self.daemon.http}", Hello(Role.DEVICE), timeout_s=DEADLINE_S) as device:
            device.wait_for(lambda: device.protocol.frame is not None, DEADLINE_S)
            self.assertIsNotNone(device.exchange(unit_pose([5, 0, -60]), DEADLINE_S))

        async def first_frame():
            client = await brachyd.AsyncClient.connect(f"ws://{self.daemon.http}")
            async for message in client:
                if isinstance(message, brachyd.Frame):
                    await client.close()
                    return message

        self.assertTrue(asyncio.run(asyncio.wait_for(first_frame(), DEADLINE_S)).is_full)

    def test_wss_is_encrypted_also_where_no_context_is_given(self):
        heard, token = [], bytes(range(32))

        def listen(listener):
            peer, _ = listener.accept()
            with peer:
                heard.append(peer.recv(4096))

        def connect(address):
            brachyd.Client(address, Hello(token=token), timeout_s=DEADLINE_S)

        def connect_later(address):
            asyncio.run(brachyd.AsyncClient.connect(address, Hello(token=token)))

        for way in (connect, connect_later):
            with socket.create_server(("127.0.0.1", 0)) as listener:
                thread = threading.Thread(target=listen, args=[listener])
                thread.start()
                with self.assertRaises((ssl.SSLError, ConnectionError)):
                    way("wss://127.0.0.1:%d" % listener.getsockname()[1])
                thread.join()
            self.assertEqual(heard[-1][:1], b"\x16", "a TLS handshake")
            self.assertNotIn(token, heard[-1])

    def test_a_port_of_another_protocol_is_refused_in_words(self):
        with self.assertRaises((ConnectionError, brachyd.ProtocolError)):
            brachyd.Client(self.daemon.http, timeout_s=DEADLINE_S)  # the port waits for the rest of a request
        with self.assertRaisesRegex(ValueError, "needs HOST:PORT"):
            brachyd.Client("http://" + self.daemon.http)


class Devices(WithDaemon):
    def test_a_force_answers_each_pose(self):
        device = self.client(role=Role.DEVICE, subscription=Subscription.NO_MESH, damping_n_s_per_mm=0.5)
        limits = device.protocol.welcome.limits
        self.assertEqual(limits.not_plausible, 4)
        self.assertEqual((limits.max_force_n, limits.damping_n_s_per_mm, limits.rate_hz), (3.3, 0.0005, 1000))
        answers = [device.exchange(unit_pose([5, 0, -60 + 0.05 * i]), DEADLINE_S) for i in range(100)]
        self.assertEqual(sum(answer is None for answer in answers), 0)
        self.assertTrue(all(np.isfinite(answer.forces.force_n).all() for answer in answers))

    def test_a_local_model_gives_the_force_that_the_server_follows(self):
        device = self.client(role=Role.DEVICE, subscription=Subscription.NO_MESH, evaluates_local_model=True)
        local, depth, pushed = brachyd.LocalForce(), -60.0, 0.0

        def push():
            nonlocal depth, pushed
            depth = depth + 0.1 if depth < 15 else -60.0  # in again, where the force was gone meanwhile
            now = time.monotonic_ns()
            tip = [5, 0, depth]
            force = local.evaluate(tip, now)
            device.protocol.send_pose(unit_pose(tip), now)
            for message in device.poll(0.002):
                if isinstance(message, brachyd.LocalModel):
                    if message.flags & ForceFlag.LATCHED:
                        device.arm()  # the machine was busy
                    local.take(message, message.input_stamp_ns if message.input_sequence else None, time.monotonic_ns())
            pushed = max(pushed, -force[2])

        wait_until(lambda: pushed >= 0.05, push)  # the tissue pushes the needle out, along -z

    def test_the_second_device_is_told_and_the_next_one_connects(self):
        first = brachyd.Client(self.daemon.address, Hello(Role.DEVICE, "first"), timeout_s=DEADLINE_S)
        with self.assertRaises(brachyd.ServerError) as refused:
            self.client(role=Role.DEVICE, name="second")
        self.assertEqual(refused.exception.error.code, ErrorCode.DEVICE_BUSY)
        self.assertIn("first", str(refused.exception))
        first.close()

        def connects():
            try:
                self.client(role=Role.DEVICE, name="second")
                return True
            except brachyd.ServerError:
                return False

        wait_until(connects)  # the needle is free once the server has seen the end

    def test_an_operator_controls_and_a_viewer_does_not(self):
        operator, viewer = self.client(role=Role.OPERATOR), self.client()
        viewer.control(ControlAction.RESET)
        viewer.wait_for(lambda: len(viewer.errors) > 0, DEADLINE_S)
        self.assertEqual(viewer.errors[0].code, ErrorCode.NOT_OPERATOR)
        operator.wait_for(lambda: operator.protocol.frame is not None, DEADLINE_S)
        operator.control(ControlAction.MODEL, kernel="psi32", support_radius_mm=20)
        operator.wait_for(lambda: operator.protocol.state is not None and operator.protocol.state.kernel == "psi32",
                          DEADLINE_S)
        self.assertEqual(operator.protocol.state.support_radius_mm, 20)


class Examples(WithDaemon):
    def run_example(self, name, *more):
        environment = dict(os.environ, PYTHONPATH=str(ROOT / "apps/python"))
        line = [sys.executable, str(ROOT / "apps/python/examples" / name), self.daemon.address, *more]
        ended = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=DEADLINE_S)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return ended.stdout

    def test_an_insertion_meets_a_force(self):
        rows = re.findall(r"tip +(\S+) mm +axial +(\S+) N", self.run_example("insertion.py", "5"))
        self.assertGreaterEqual(len(rows), 8)
        self.assertEqual(float(rows[0][1]), 0)

    def test_an_insertion_meets_a_force_again_and_again(self):
        for run in range(3):
            out = self.run_example("insertion.py", "10")
            forces = [float(axial) for axial in re.findall(r"axial +(\S+) N", out)]
            self.assertGreater(max(abs(force) for force in forces), 0.2, f"run {run}: {out}")

    def test_round_trips_are_measured(self):
        out = self.run_example("round_trip.py", "200", "1")
        found = re.match(r"(\d+) forces of (\d+) poses: p50 (\S+) ms", out)
        self.assertGreater(int(found[1]), 0, out)


class Access(unittest.TestCase):
    def test_tls_and_token(self):
        with tempfile.TemporaryDirectory() as folder:
            def run(line):
                return subprocess.run(line, cwd=folder, check=True, capture_output=True, text=True).stdout

            run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "key.pem", "-out", "cert.pem",
                 "-days", "2", "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"])
            run([BRACHY, "token", "a.token"])
            os.chmod(os.path.join(folder, "key.pem"), 0o600)
            token = bytes.fromhex(run([BRACHY, "token", "--show", "a.token"]).strip())
            scene = pathlib.Path(folder) / "scene.toml"
            scene.write_text('[server]\ntoken_file = "a.token"\ntls_certificate = "cert.pem"\ntls_key = "key.pem"\n')
            daemon = Daemon(folder, "--config", str(scene))
            try:
                tls = ssl.create_default_context(cafile=os.path.join(folder, "cert.pem"))
                with brachyd.Client(daemon.address, Hello(token=token), tls) as client:
                    client.wait_for(lambda: client.protocol.frame is not None, DEADLINE_S)
                with self.assertRaises(brachyd.ServerError) as refused:
                    brachyd.Client(daemon.address, Hello(token=bytes(32)), tls)
                self.assertEqual(refused.exception.error.code, ErrorCode.UNAUTHORISED)
                with self.assertRaises(brachyd.ServerError):
                    brachyd.Client(daemon.address, Hello(token=token))
            finally:
                daemon.end()


    def test_a_probe_of_health_is_answered_whoever_guesses_tokens_beside_it(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([BRACHY, "token", "a.token"], cwd=folder, check=True, capture_output=True)
            scene = pathlib.Path(folder) / "scene.toml"
            scene.write_text('[server]\ntoken_file = "a.token"\n')
            daemon = Daemon(folder, "--config", str(scene), "--http-port", "0")
            try:
                for _ in range(15):
                    with self.assertRaises(brachyd.ServerError):
                        brachyd.Client(daemon.address, Hello(token=bytes(32)))
                    with self.assertRaises(urllib.error.HTTPError) as refused:
                        headers = {"Authorization": "Bearer " + 64 * "0"}
                        urllib.request.urlopen(urllib.request.Request(f"http://{daemon.http}/metrics", headers=headers))
                    self.assertEqual(refused.exception.code, 401)
                    refused.exception.close()
                with urllib.request.urlopen(f"http://{daemon.http}/healthz") as answer:
                    self.assertEqual((answer.status, answer.read().strip()), (200, b"ok"))
            finally:
                daemon.end()


class Installed(unittest.TestCase):
    def test_pip_installs_it_without_a_network(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import ensurepip"], capture_output=True).returncode != 0:
            self.skipTest("python3-venv is missing: scripts/setup.sh --tests")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["/usr/bin/python3", "-m", "venv", "--system-site-packages", folder], check=True)
            pip = subprocess.run([f"{folder}/bin/pip", "install", "--no-index", str(ROOT / "apps/python")], cwd=folder,
                                 capture_output=True, text=True)
            self.assertEqual(pip.returncode, 0, pip.stdout + pip.stderr)
            code = ("import brachyd, importlib.resources as r; "
                    "print(brachyd.__file__, r.files('brachyd').joinpath('py.typed').is_file())")
            shown = subprocess.run([f"{folder}/bin/python", "-I", "-c", code], cwd=folder, check=True,
                                   capture_output=True, text=True)
            self.assertIn(folder, shown.stdout)
            self.assertIn("True", shown.stdout)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
