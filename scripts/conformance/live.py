"""Conversations with a real brachyd: the client's meshes are those of another viewer's FULL frames, bit for bit; its
poses push a needle into tissue that pushes back; a second device is refused; the daemon stops."""
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import time

from conversations import ROLES
from judge import ERRORS, GUARD_S, SCHEMA, Client, Failed, Peer, mesh_of, require

FLAGS = SCHEMA.all["flags"]
SCENE = """
[tissue]
points = 600
phantom_surface_vertices = 150
[rates]
deformation_hz = 100
snapshot_hz = 20
"""


class Daemon:
    def __init__(self, program):
        self.folder = tempfile.TemporaryDirectory()
        scene = pathlib.Path(self.folder.name) / "scene.toml"
        scene.write_text(SCENE, encoding="utf-8")
        self.process = subprocess.Popen([program, "--config", scene, "--port", "0", "--duration", "300"],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        found = re.match(r"brachyd listening on .*:(\d+)$", self.process.stdout.readline())
        if not found:
            self.__exit__()
            raise SystemExit(f"conformance: {program} did not start")
        self.port = int(found[1])

    def __enter__(self):
        return self

    def __exit__(self, *ignored):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait()
        self.process.stdout.close()
        self.folder.cleanup()

    def join(self, role, subscription):
        """A connection of the judge's own, welcomed."""
        peer = Peer(socket.create_connection(("127.0.0.1", self.port), GUARD_S))
        peer.stamp = time.monotonic_ns()
        bits = sum(FLAGS["Subscription"]["values"][name] for name in subscription)
        nothing = dict.fromkeys(("max_force_n", "max_stiffness_n_per_mm", "damping_n_s_per_mm", "rate_hz"), "nan")
        peer.send("HELLO", {"role": ROLES[role], "subscription": bits, "name": "judge", **nothing})
        peer.wait("WELCOME")
        return peer


def insert(peer, depth):
    """A pose of needle 0 at that depth of its tip, mm."""
    peer.stamp = max(peer.stamp, time.monotonic_ns())
    peer.send("POSE", {"needle": 0, "flags": 0, "X_WN": [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, depth]]})


def live_viewer(v, command, daemon):
    judge, needle = daemon.join("VIEWER", ["FULL_FRAMES"]), daemon.join("DEVICE", ["NO_MESH"])
    try:
        with Client(command, daemon.port, "viewer") as client:
            v.begin("mesh of a running brachyd",
                    "No change is lost: a FRAME's changes are relative to the last FRAME *this* client was sent.")
            client.wait("frame")
            depth, same, meshes = -30.0, 0, {}
            end = time.monotonic() + GUARD_S
            while same < 5:
                if time.monotonic() > end:
                    raise Failed("no mesh of a tick that the judge was sent, too")
                _, _, frame, _ = judge.wait("FRAME")  # 20 a second: no pace but the daemon's
                depth = min(depth + 1, 20)
                insert(needle, depth)
                if frame["max_displacement_mm"] > 0.05:
                    meshes[frame["tick"]] = mesh_of(frame["positions"])
                while client.take(0):
                    pass
                shown = {line["tick"]: line["mesh"] for key, line in client.lines if key == "frame"}
                for tick in meshes.keys() & shown.keys():
                    require(shown[tick] == meshes[tick], f"another mesh in tick {tick}")
                same = len(meshes.keys() & shown.keys())
    finally:
        judge.close()
        needle.close()


def live_device(v, command, daemon):
    judge = daemon.join("VIEWER", ["NO_MESH"])
    try:
        with Client(command, daemon.port, "device") as client:
            v.begin("force of a running brachyd", "on the needle: the tissue's, and what the template's hole does")
            client.wait("force", lambda f: max(map(abs, f["force_n"])) > 0.05)
            v.begin("poses are accepted", "stamp poses when they are taken, drop those that wait")
            judge.send_state_request()
            _, _, state, _ = judge.wait("STATE", lambda entry: entry[2]["poses_accepted"] > 0)
            refused = [refusal for refusal in state["refusals"] if refusal["code"] in (1, 2, 4, 5, 6, 0xFF02, 0xFF03)]
            require(not refused, f"refused: {refused}")
            v.begin("second device",
                    "Each needle has one device at most: the first client with the role device whose HELLO asks for "
                    "that needle")
            with Client(command, daemon.port, "device") as second:
                error = second.wait("error")
                require(error["code"] == ERRORS["DEVICE_BUSY"] and error["fatal"] == 1 and error["text"], f"{error}")
                second.finish()
    finally:
        judge.close()


def live_stop(v, command, daemon):
    with Client(command, daemon.port, "viewer") as client:
        client.wait("frame")
        v.begin("server stops", "| 10 SHUTDOWN | yes | the server stops |")
        os.kill(daemon.process.pid, signal.SIGTERM)
        client.wait("error", lambda e: e["code"] == ERRORS["SHUTDOWN"] and e["fatal"] == 1)
        client.finish()


ALL = [live_viewer, live_device, live_stop]
