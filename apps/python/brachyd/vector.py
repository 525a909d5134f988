"""Many steering environments on several processes, which share the memory of actions and observations.

The caller's process has its share of the environments and steps them while the others step theirs, so that with a
process for each core no core waits for another's messages. Each of the others is a program of its own, started afresh,
that talks over two pipes: no main guard is needed, nothing of the caller is copied by fork, and a process that ends is
noticed, on either side. The memory has no name: nothing of it is left in /dev/shm, however the processes end.
"""
from __future__ import annotations

import mmap
import os
import pickle
import signal
import struct
import subprocess
import sys
import traceback
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from .spaces import NEXT_STEP, VectorEnv, of_many
from .steering import NeedleSteering, SteeringSettings

Array = npt.NDArray[np.float64]
# Messages: one byte, and in all but the first two a length and so many bytes.
STEP, DONE, SET_UP, RESET, FAILED = b"s", b"d", b"u", b"r", b"f"
CODE = "import sys; from brachyd.vector import work; work(*map(int, sys.argv[1:]))"


@dataclass
class _Shared:
    """The arrays in the shared memory, of n environments whose observation has m numbers."""
    actions: Array  # n×2
    observations: Array  # n×m
    rewards: Array  # n
    error_mm: Array  # n
    outcome: npt.NDArray[np.int64]  # n
    terminated: npt.NDArray[np.bool_]  # n
    truncated: npt.NDArray[np.bool_]  # n

    @staticmethod
    def size(n: int, m: int) -> int:
        return n * (8 * (2 + m + 3) + 2)

    @classmethod
    def of(cls, memory: mmap.mmap, n: int, m: int) -> "_Shared":
        arrays: List[Any] = []
        offset = 0
        for kind, shape in ((np.float64, (n, 2)), (np.float64, (n, m)), (np.float64, (n,)), (np.float64, (n,)),
                            (np.int64, (n,)), (np.bool_, (n,)), (np.bool_, (n,))):
            arrays.append(np.ndarray(shape, kind, memory, offset))
            offset += arrays[-1].nbytes
        return cls(*arrays)


class VectorNeedleSteering(VectorEnv):
    """`num_envs` NeedleSteering on `processes` processes, as Gymnasium's VectorEnv. The caller's is one of them; by
    default there is one for each core.

    Environment i of reset(seed=s) has the seed s + i, and the bits of a single NeedleSteering with it. Autoreset is
    Gymnasium's "next step": the step after the one that ends an episode resets that environment, whatever its action,
    and gives its first observation, reward 0. `metadata["autoreset_mode"]` says so.
    In `info`: `error_mm` and `outcome` of each, as NeedleSteering's. Results are copies; with `copy=False` they are the
    shared memory itself, which the next step changes.

    Errors: ValueError for settings, seeds and actions that cannot be used; RuntimeError where a process fails or ends:
    it says which (0: the caller's), and why; the others are ended then. close() ends them, as does leaving a `with`.
    Threads: one.
    """

    def __init__(self, num_envs: int, settings: SteeringSettings = SteeringSettings(), *,
                 processes: Optional[int] = None, copy: bool = True) -> None:
        count = processes if processes is not None else min(num_envs, len(os.sched_getaffinity(0)))
        if not 1 <= count <= num_envs:
            raise ValueError(f"{num_envs} environments on {count} processes: at least one on each")
        first = NeedleSteering(settings)
        self.num_envs, self.settings, self.reach, self.copy = num_envs, settings, first.reach, copy
        self.observation_fields = first.observation_fields
        self.advance_mm, self.turn_rad = first.advance_mm, first.turn_rad
        self.metadata = {"render_modes": [], "autoreset_mode": NEXT_STEP}
        self.single_observation_space, self.single_action_space = first.observation_space, first.action_space
        self.observation_space = of_many(first.observation_space, num_envs)
        self.action_space = of_many(first.action_space, num_envs)
        m = first.observation_space.shape[0]
        self._workers: List[_Worker] = []
        self._is_stepping = False
        self._all = np.ones(num_envs, dtype=np.bool_)
        memory = os.memfd_create("brachyd")
        try:
            os.ftruncate(memory, _Shared.size(num_envs, m))
            self._shared = _Shared.of(mmap.mmap(memory, 0), num_envs, m)
            own, *others = np.array_split(np.arange(num_envs), count)
            for mine in others:
                self._workers.append(_Worker(len(self._workers) + 1, mine.tolist(), memory))
            self._own = _Environments(self._shared, first, own.tolist())
            for worker in self._workers:
                self._send(worker, SET_UP, pickle.dumps((settings, first.reach, worker.mine, num_envs, m)))
            self._wait()
        except BaseException:
            self.close()
            raise
        finally:
            os.close(memory)

    def reset(self, *, seed: Optional[Union[int, Sequence[Optional[int]]]] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Array, Dict[str, Any]]:
        """`seed`: of the first environment, or one of each. `options`: NeedleSteering's, for all."""
        if seed is None or isinstance(seed, int):
            seeds: List[Optional[int]] = [None if seed is None else seed + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} environments")
        self._check_open()
        for worker in self._workers:
            self._send(worker, RESET, pickle.dumps(([seeds[i] for i in worker.mine], options)))
        self._do_own(lambda: self._own.reset(seeds[:len(self._own.all)], options))
        self._wait()
        return self._observations(), self._info()

    def step(self, actions: npt.ArrayLike) -> Tuple[Array, Array, npt.NDArray[np.bool_], npt.NDArray[np.bool_],
                                                    Dict[str, Any]]:
        """One tick of each; `actions` n×2."""
        self.step_async(actions)
        return self.step_wait()

    def step_async(self, actions: npt.ArrayLike) -> None:
        """Begins a step on the other processes; the caller's own environments step in step_wait()."""
        self._check_open()
        if self._is_stepping:
            raise RuntimeError("step_async twice: step_wait comes between")
        array = np.asarray(actions, dtype=np.float64)
        if array.shape != self._shared.actions.shape or not np.isfinite(array).all():
            raise ValueError(f"actions are {self._shared.actions.shape} finite numbers, −1 … 1")
        self._shared.actions[:] = array
        for worker in self._workers:
            self._send(worker, STEP)
        self._is_stepping = True

    def step_wait(self) -> Tuple[Array, Array, npt.NDArray[np.bool_], npt.NDArray[np.bool_], Dict[str, Any]]:
        """The results of the step that step_async() began."""
        if not self._is_stepping:
            raise RuntimeError("step_wait without step_async")
        self._do_own(self._own.step)
        self._wait()
        shared = self._shared
        flags = (shared.terminated, shared.truncated)
        if self.copy:
            return (self._observations(), shared.rewards.copy(), flags[0].copy(), flags[1].copy(), self._info())
        return self._observations(), shared.rewards, *flags, self._info()

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the processes."""
        for worker in self._workers:
            worker.end()

    def __enter__(self) -> "VectorNeedleSteering":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def processor_s(self) -> float:
        """Processor time of the other processes until now, s."""
        return sum(worker.processor_s() for worker in self._workers)

    def _observations(self) -> Array:
        return self._shared.observations.copy() if self.copy else self._shared.observations

    def _info(self) -> Dict[str, Any]:
        error, outcome = self._shared.error_mm, self._shared.outcome
        return {"error_mm": error.copy() if self.copy else error, "_error_mm": self._all,
                "outcome": outcome.copy() if self.copy else outcome, "_outcome": self._all}

    def _check_open(self) -> None:
        if self.closed:
            raise RuntimeError("this VectorNeedleSteering is closed")

    def _send(self, worker: "_Worker", kind: bytes, body: Optional[bytes] = None) -> None:
        try:
            _send(worker.out, kind, body)
        except OSError:
            self._fail(worker, worker.why())

    def _wait(self) -> None:
        """Until every process has done what it was told."""
        self._is_stepping = False
        for worker in self._workers:
            kind, body = _receive(worker.answers)
            if kind != DONE:
                self._fail(worker, body.decode() if kind == FAILED and body else worker.why())

    def _do_own(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:
            self.close()
            mine = self._own.mine
            whose = f"process 0, of environments {mine.start} to {mine.stop - 1}"
            raise RuntimeError(f"{whose}, failed: {error}") from error
        except BaseException:  # an interrupt: the answers of the others would be taken for the next step's
            self.close()
            raise

    def _fail(self, worker: "_Worker", why: str) -> None:
        self.close()
        raise RuntimeError(f"process {worker.number}, of environments {worker.mine[0]} to {worker.mine[-1]}, {why}")


class _Worker:
    """Another process as the caller sees it."""

    def __init__(self, number: int, mine: List[int], memory: int) -> None:
        self.number, self.mine = number, mine
        commands, self.out = os.pipe()
        self.answers, answers = os.pipe()
        path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", CODE, str(commands), str(answers), str(memory)],
                stdin=subprocess.DEVNULL, pass_fds=(commands, answers, memory), env={**os.environ, "PYTHONPATH": path})
        finally:
            os.close(commands)
            os.close(answers)

    @property
    def pid(self) -> int:
        return self._process.pid

    def why(self) -> str:
        """How it ended, if it did not say why."""
        code = self._process.wait(timeout=10)
        return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"has ended with exit code {code}"

    def processor_s(self) -> float:
        with open(f"/proc/{self.pid}/stat", encoding="ascii") as file:
            fields = file.read().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """It ends at the end of its commands; else by a signal."""
        if self.out < 0:
            return
        os.close(self.out)
        os.close(self.answers)
        self.out = self.answers = -1
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __del__(self) -> None:
        if hasattr(self, "_process"):
            self.end()


def work(commands: int, answers: int, memory: int) -> None:
    """The process: does what the commands say until they end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller ends it
    environments: Optional[_Environments] = None
    while True:
        kind, body = _receive(commands)
        answer: Tuple[bytes, Optional[bytes]] = (DONE, None)
        try:
            if kind == SET_UP:
                settings, reach, mine, n, m = pickle.loads(body)
                shared = _Shared.of(mmap.mmap(memory, 0), n, m)
                environments = _Environments(shared, NeedleSteering(settings, reach=reach), mine)
            elif environments is None or not kind:
                return
            elif kind == STEP:
                environments.step()
            else:
                environments.reset(*pickle.loads(body))
        except Exception:
            answer = (FAILED, b"failed:\n" + traceback.format_exc().encode())
        try:
            _send(answers, *answer)
        except BrokenPipeError:
            return


class _Environments:
    """Those of one process, the first of which is `first`, whose model they share."""

    def __init__(self, shared: _Shared, first: NeedleSteering, mine: List[int]) -> None:
        self.shared = shared
        self.all = [(i, first if i == mine[0] else NeedleSteering(first.settings, like=first)) for i in mine]
        for i, environment in self.all:
            environment.use_row(self.shared.observations[i])
        self.mine = slice(mine[0], mine[-1] + 1)
        self.actions = self.shared.actions[self.mine]
        self.is_over = [False] * len(mine)

    def reset(self, seeds: List[Optional[int]], options: Optional[Dict[str, Any]]) -> None:
        shared, mine = self.shared, self.mine
        for (_, environment), seed in zip(self.all, seeds):
            environment.reset(seed=seed, options=options)
        shared.rewards[mine], shared.terminated[mine], shared.truncated[mine] = 0, False, False
        self.is_over = [False] * len(self.all)
        self._tell()

    def step(self) -> None:
        shared = self.shared
        results = []
        for k, ((_, environment), action) in enumerate(zip(self.all, self.actions.tolist())):
            if self.is_over[k]:
                environment.reset()
                results.append((0.0, False, False))
            else:
                results.append(environment.advance(*action))
            self.is_over[k] = results[-1][1] or results[-1][2]
        shared.rewards[self.mine], shared.terminated[self.mine], shared.truncated[self.mine] = zip(*results)
        self._tell()

    def _tell(self) -> None:
        self.shared.error_mm[self.mine] = [environment.error_mm for _, environment in self.all]
        self.shared.outcome[self.mine] = [environment.outcome for _, environment in self.all]


def _send(file: int, kind: bytes, body: Optional[bytes] = None) -> None:
    data = kind if body is None else kind + struct.pack("<I", len(body)) + body
    while data:
        data = data[os.write(file, data):]


def _receive(file: int) -> Tuple[bytes, bytes]:
    """Kind and body of a message; nothing where the other side has ended, within a message too."""
    kind = os.read(file, 1)
    if kind in (b"", STEP, DONE):
        return kind, b""
    try:
        return kind, _read(file, struct.unpack("<I", _read(file, 4))[0])
    except EOFError:
        return b"", b""


def _read(file: int, size: int) -> bytes:
    data = b""
    while len(data) < size:
        part = os.read(file, size - len(data))
        if not part:
            raise EOFError("the other process has ended within a message")
        data += part
    return data
