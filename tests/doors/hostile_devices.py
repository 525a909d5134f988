#!/usr/bin/env python3
"""Devices whose poses are late, doubled, reordered, missing, foreign, not finite, far away, no rotation, in metres,
with their quaternion in another order, or of a clock that is set, on each door of a running brachyd: random
sequences, of a
seed. What the daemon streams is read by another client, of net/protocol.json alone: no needle was moved by a pose that
is wrong, nor to where no pose was; forces are finite and a hand's within its limit; and an EVENT names each kind once
for each device, and no kind that it does not have. Prints a table.

usage: tests/doors/hostile_devices.py BRACHYD [SEQUENCES [SEED]]
  SEQUENCES on each door: 8; the nightly run has 1000. Exit code 1: something is not so; 77: skipped, with its reason
"""
import collections
import os
import random
import select
import sys
import threading
import time

from doors import DEADLINE_S, NAN, SCHEMA, SMALL, Daemon, IgtlDoor, NativeDoor, PythonDoor, np

SCENE = SMALL + """
[needle]
count = 3
[device]
stale_pose_ms = 600
[ultrasound]
on = false
"""
LATE_S = 0.9          # beyond stale_pose_ms
PERIOD_S = 0.01
POSES = 60
STEP_MM = 1.0
HAND_N = 3.3          # a device's limit that states none
TISSUE_N = 200.0      # no needle feels more in this scene
WARNING, SAFETY = (SCHEMA.all["enums"]["EventKind"]["values"][name] for name in ("WARNING", "SAFETY"))
SUBSCRIBED = sum(SCHEMA.all["flags"]["Subscription"]["values"][name] for name in ("POSE_HISTORY", "SURFACE"))
# What the EVENT of a kind says after the device's name. None: the safety event of a force without poses.
NAMES = {"late": "late poses", "doubled": "doubled poses", "reordered": "reordered poses", "missing": "missing poses",
         "foreign": "foreign poses", "nan": "poses that are not finite", "far": "poses far away",
         "rotation": "poses that are no rotation", "metres": "poses in metres",
         "order": "quaternions in another order", "clock": "the clock of its poses was set"}
FROM_THE_START = {"metres from the start": "metres", "order from the start": "order"}


def rotation(q):
    """Rows, of a quaternion x, y, z, w."""
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def cycled(q):
    """w, x, y, z read as x, y, z, w."""
    return np.array([q[3], q[0], q[1], q[2]])


class Sequence:
    """One device's poses: a way into the tissue, and the faults that it has."""

    def __init__(self, rng, kinds):
        self.kinds = kinds
        self.start = np.array([rng.uniform(-8, 8), rng.uniform(-8, 8), -62.0])
        tilt, turn = np.radians(rng.uniform(2, 15)), rng.uniform(0, 2 * np.pi)
        self.q = np.array([np.sin(tilt / 2) * np.cos(turn), np.sin(tilt / 2) * np.sin(turn), 0, np.cos(tilt / 2)])
        self.at = dict(zip(rng.sample(range(8, POSES - 8, 9), len(kinds)), kinds))  # apart from each other
        self.step_s = rng.choice([-1.0, 1.0])

    def pose(self, n):
        """Pose n as it is: 3×4."""
        q, tip = self.q, self.start + [0, 0, STEP_MM * n]
        if "order from the start" in self.kinds:
            q = cycled(q)
        if "metres from the start" in self.kinds:
            tip = tip / 1000
        return np.column_stack([rotation(q), tip])


class Outcome:
    def __init__(self, door, number, kinds):
        self.door, self.number, self.kinds = door, number, kinds
        self.device = ""       # what its events begin with, or hold
        self.needle = 0
        self.good, self.wrong, self.either = [], [], []
        self.forces = []


class Native:
    """A device of the native protocol; its forces are read."""
    kinds = ["late", "doubled", "reordered", "missing", "foreign", "nan", "far", "rotation", "metres", "order", "clock",
             *FROM_THE_START]
    name, make, needle = "native", NativeDoor, 0

    def __init__(self, daemon, outcome):
        self.outcome = outcome
        self.door = self.make(daemon, "DEVICE", self.needle, name=f"{self.name} {outcome.number}")
        outcome.device, outcome.needle = f"{self.name} {outcome.number} (", self.needle
        self.door.request("ARM", {"needle": self.needle})

    def send(self, X, stamp_ns):
        self.door.pose(X, stamp_ns, self.needle)

    def foreign(self, X, stamp_ns):
        self.door.pose(X, stamp_ns, (self.needle + 1) % 3)

    def missing(self, _, stamp_ns):
        del stamp_ns
        time.sleep(0.2)  # no poses

    def take(self):
        """What has come."""
        while select.select([self.door.link.socket], [], [], 0)[0]:
            data = self.door.link.receive()
            if not data:
                raise AssertionError("the daemon closed the connection of a device")
            self.door.data += data
        for name, body in self.door.complete():
            if name == "FORCE":
                self.outcome.forces.append(body["force_n"])

    def close(self):
        self.take()
        self.door.close()


class Python(Native):
    """The same by brachyd.Client."""
    name, make, needle = "Python", PythonDoor, 1

    def take(self):
        for message in self.door.client.poll():
            if type(message).__name__ == "Force":
                self.outcome.forces.append(list(message.forces.force_n))


class Igtl:
    """A tracker over OpenIGTLink. It gets no force for a hand."""
    kinds = Native.kinds
    name, needle = "OpenIGTLink", 2
    ports = set()  # of all so far

    def __init__(self, daemon, outcome):
        self.door = IgtlDoor(daemon)
        port = self.door.socket.getsockname()[1]
        while port in self.ports:  # its events would be taken for those of an earlier device of this door
            self.door.close()
            self.door = IgtlDoor(daemon)
            port = self.door.socket.getsockname()[1]
        self.ports.add(port)
        outcome.device, outcome.needle = f"(OpenIGTLink 127.0.0.1:{port})", self.needle
        self.started_ns = time.time_ns() - time.monotonic_ns()

    def send(self, X, stamp_ns):
        self.door.pose(X, self.started_ns + stamp_ns, self.needle, version=2)

    def foreign(self, X, stamp_ns):
        self.door.pose(X, self.started_ns + stamp_ns, device="CameraToRas", version=2)

    def missing(self, X, stamp_ns):
        self.door.pose(X, self.started_ns + stamp_ns, self.needle, version=2,
                       metadata=(("TransformStatus", "MISSING"),))

    def take(self):
        while select.select([self.door.socket], [], [], 0)[0]:
            if not self.door.socket.recv(1 << 18):
                raise AssertionError("the daemon closed the connection of a tracker")

    def close(self):
        self.door.close()


def play(device, sequence, outcome):
    """Sends the poses of a sequence, each wrong as it is to be."""
    offset_ns = 0
    n, aside = 0, []  # poses that are sent later
    while n < POSES:
        kind = sequence.at.get(n)
        X, stamp_ns = sequence.pose(n), time.monotonic_ns() + offset_ns
        wrong = []
        if kind == "late":
            time.sleep(LATE_S)
            wrong = [X]
        elif kind == "doubled":
            device.send(X, stamp_ns)
            outcome.good.append(X)
        elif kind == "reordered":
            later = X + np.column_stack([np.zeros((3, 3)), [0, 0, 0.5]])
            outcome.good.append(later)
            device.send(later, stamp_ns + 1_000_000)
            wrong = [X]
        elif kind == "missing":
            lost = X + np.column_stack([np.zeros((3, 3)), [17.0, 0, 0]])
            outcome.wrong.append(lost)
            device.missing(lost, stamp_ns)
            stamp_ns = time.monotonic_ns() + offset_ns
        elif kind == "foreign":
            strange = X + np.column_stack([np.zeros((3, 3)), [23.0, 0, 0]])
            outcome.wrong.append(strange)
            device.foreign(strange, stamp_ns)
        elif kind == "nan":
            X = X * np.array([[1, 1, 1, NAN]])
            wrong = [X]
        elif kind == "far":
            X = X + np.column_stack([np.zeros((3, 3)), [0, 0, 20_000]])
            wrong = [X]
        elif kind == "rotation":
            X = X * np.array([[1.2, 1.2, 1.2, 1]])
            wrong = [X]
        elif kind == "metres":
            X = X * np.array([[1, 1, 1, 1e-3]])
            wrong = [X]
        elif kind == "order":
            X = np.column_stack([rotation(cycled(sequence.q)), X[:, 3]])
            wrong = [X]
        elif kind == "clock":
            offset_ns += int(sequence.step_s * 1e9)
            stamp_ns += int(sequence.step_s * 1e9)
            aside = [n, n + 1, n + 2, n + 3]
        if wrong:
            outcome.wrong.append(X)
        elif n in aside:
            outcome.either.append(X)  # the first ones of a clock that was set
        else:
            outcome.good.append(X)
        device.send(X, stamp_ns)
        device.take()
        time.sleep(PERIOD_S)
        n += 1
    time.sleep(0.1)


class Observer(threading.Thread):
    """Reads what the daemon streams: events, forces and every pose that the simulation used."""

    def __init__(self, daemon):
        super().__init__(daemon=True)
        self.door = NativeDoor(daemon)
        limits = dict.fromkeys(("max_force_n", "max_stiffness_n_per_mm", "damping_n_s_per_mm", "rate_hz"), "nan")
        hello = {"role": 1, "subscription": SUBSCRIBED, "name": "observer", **limits}
        self.door.link.send([self.door.encode("HELLO", hello)])
        self.door.wait(lambda name, body: name == "WELCOME")
        self.lock = threading.Lock()
        self.used = collections.defaultdict(list)  # by needle
        self.events, self.forces, self.frames, self.problem = [], [], 0, None

    def run(self):
        try:
            for name, body in self.door.messages():
                with self.lock:
                    self.read(name, body, self.door.sections)
            self.problem = "the daemon ended its connection"
        except Exception as problem:  # pylint: disable=broad-except
            self.problem = problem

    def read(self, name, body, sections):
        if name == "EVENT":
            self.events.append((body["kind"], body["needle"], body["text"]))
        if name != "FRAME":
            return
        self.frames += 1
        self.forces += [entry["forces"]["force_n"] for entry in sections.get("FORCE", {}).get("entries", [])]
        for pose in sections.get("POSE_HISTORY", {}).get("entries", []):
            self.used[0].append(pose["X_WN"])
        for needle in sections.get("POSES_OF_NEEDLES", {}).get("needles", []):
            for pose in needle["poses"]:
                self.used[needle["needle"]].append(pose["X_WN"])


def run_door(make, daemon, sequences, seed, outcomes):
    for number in range(sequences):
        rng = random.Random(f"{seed} {make.name} {number}")
        kinds = rng.sample(make.kinds[:-2], rng.choice([1, 2, 2]))
        if number % 6 == 5:
            kinds = [make.kinds[-2 + number // 6 % 2]]  # alone
        outcome = Outcome(make.name, number, kinds)
        end = time.monotonic() + DEADLINE_S
        while True:
            try:
                device = make(daemon, outcome)
                break
            except Exception:  # pylint: disable=broad-except
                if time.monotonic() > end:  # the needle's last device is still there
                    raise
                time.sleep(0.01)
        play(device, Sequence(rng, kinds), outcome)
        device.close()
        outcomes.append(outcome)


class Poses:
    """Many poses, found by one number of each: a campaign compares some hundred thousand with as many."""
    WEIGHTS = np.sqrt(np.arange(2.0, 14.0))

    def __init__(self, poses):
        rows = np.array(poses, dtype=float).reshape(-1, 12)
        keys = rows @ self.WEIGHTS
        order = np.argsort(keys)
        self.rows, self.keys = rows[order], keys[order]

    def has(self, X, tolerance):
        row = np.ravel(X)
        key, reach = row @ self.WEIGHTS, tolerance * self.WEIGHTS.sum() + 1e-9
        first, last = np.searchsorted(self.keys, (key - reach, key + reach))
        return bool((np.abs(self.rows[first:last] - row).max(axis=1, initial=0) <= tolerance).any())


class Judge:
    def __init__(self):
        self.problems = []
        self.table = collections.defaultdict(lambda: [0, 0, 0, 0])  # by door and kind: devices, poses, named, moved

    def say(self, outcome, what):
        self.problems.append(f"{outcome.door} {outcome.number} ({', '.join(outcome.kinds)}): {what}")

    def judge(self, outcome, observer):
        exact = {"native": 1e-9, "Python": 1e-9, "OpenIGTLink": 1e-4}[outcome.door]
        used = observer.poses[outcome.needle]
        moved = sum(used.has(X, exact) for X in outcome.wrong if np.isfinite(X).all())
        if moved:
            self.say(outcome, f"{moved} wrong poses moved the needle")
        texts = [text for kind, _, text in observer.events if kind == WARNING and outcome.device in text]
        said = collections.Counter(kind for kind, name in NAMES.items() for text in texts if f"): {name}" in text)
        expected = {FROM_THE_START.get(kind, kind) for kind in outcome.kinds}
        if outcome.door != "OpenIGTLink":  # its force ends without poses: a safety event
            expected -= {"missing"}
        for kind in sorted(expected | set(said)):
            if said[kind] != (kind in expected):
                self.say(outcome, f"{kind} is named {said[kind]} times: {texts}")
        for kind in outcome.kinds:
            row = self.table[outcome.door, kind]
            row[0] += 1
            row[1] += len(outcome.wrong)
            row[2] += said[FROM_THE_START.get(kind, kind)]
            row[3] += moved
        for force in outcome.forces:
            if not (np.isfinite(force).all() and np.linalg.norm(force) <= HAND_N + 1e-9):
                self.say(outcome, f"a hand's force of {force}")

    def judge_stream(self, outcomes, observer):
        """Every pose that the simulation used was sent as a good one."""
        for door in ("native", "Python", "OpenIGTLink"):
            own = [outcome for outcome in outcomes if outcome.door == door]
            sent = Poses([X for outcome in own for X in outcome.good + outcome.either])
            exact = 1e-4 if door == "OpenIGTLink" else 1e-9
            used = observer.poses[own[0].needle].rows
            strange = [X for X in used if not sent.has(X, exact)]
            if strange:
                self.problems.append(f"{door}: the needle was at {len(strange)} poses that nobody sent as good ones: "
                                     f"{strange[0]}")
            if not len(used):
                self.problems.append(f"{door}: the needle never moved")
        if not np.isfinite(observer.forces).all():
            self.problems.append("a force of the tissue is not finite")
        elif np.linalg.norm(observer.forces, axis=1).max() > TISSUE_N:
            self.problems.append(f"a force of the tissue above {TISSUE_N} N")
        if not any(kind == SAFETY for kind, _, _ in observer.events):
            self.problems.append("no safety event named missing poses")

    def show(self, outcomes, observer):
        print(f"{'door':12} {'kind':22} {'devices':>7} {'named':>6} {'moved by wrong poses':>21}")
        for (door, kind), (devices, _, named, moved) in sorted(self.table.items()):
            by_safety = "safety" if kind == "missing" and door != "OpenIGTLink" else named
            print(f"{door:12} {kind:22} {devices:7} {by_safety:>6} {moved:21}")
        forces = np.linalg.norm([force for outcome in outcomes for force in outcome.forces] or [[0, 0, 0]], axis=1)
        print(f"{len(outcomes)} sequences, {observer.frames} frames; largest force of a hand {forces.max():.2f} N, of "
              f"the tissue {np.linalg.norm(observer.forces, axis=1).max():.1f} N")


def main():
    if len(sys.argv) not in (2, 3, 4):
        sys.exit(__doc__)
    program = os.path.abspath(sys.argv[1])
    sequences, seed = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((2, 8), (3, 1)))
    outcomes, failed = [], []
    with Daemon(program, SCENE, http=False, seconds=86400) as daemon:
        observer = Observer(daemon)
        observer.start()

        def door(make):
            try:
                run_door(make, daemon, sequences, seed, outcomes)
            except Exception as error:  # pylint: disable=broad-except
                failed.append(f"{make.name}: {error!r}")

        threads = [threading.Thread(target=door, args=(make,)) for make in (Native, Python, Igtl)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        time.sleep(1.5)  # notices that wait for their rate
        with observer.lock:
            observer.poses = {needle: Poses(observer.used[needle]) for needle in range(3)}
            judge = Judge()
            judge.problems += failed
            if observer.problem:
                judge.problems.append(f"the observer ended: {observer.problem!r}")
            for outcome in outcomes:
                judge.judge(outcome, observer)
            judge.judge_stream(outcomes, observer)
            judge.show(outcomes, observer)
    for problem in judge.problems[:40]:
        print(f"FAILED  {problem}")
    print(f"hostile devices: {sequences} sequences on each of 3 doors, seed {seed}: {len(judge.problems)} problems")
    sys.exit(1 if judge.problems else 0)


if __name__ == "__main__":
    main()
