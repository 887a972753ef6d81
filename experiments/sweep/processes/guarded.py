"""A child process that executes calls under limits of time, memory and processes.

The parent survives whatever the child does, and nothing that the child started is left
when it ends: it leads a session of its own, which is killed as a whole, and its
orphans come to the parent (Linux), which kills them too.
"""

import os
import pickle
import select
import signal
import struct
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from time import monotonic, sleep
from typing import Any, NoReturn, Self

import psutil

from experiments.errors import ExperimentError, described
from experiments.sweep.processes.tree import (
    adopt_orphans,
    children,
    end_with_parent,
    kill_all,
    kill_group,
    memory,
    with_descendants,
)

INTERVAL = 0.1  # between two checks of the limits [s]
MAX_PROCESSES = 64  # that a call may have at a time
CLOSED_PATIENCE = 1.0  # with a child that has closed its pipe [s]
OUTPUT_LIMIT = 1_000_000  # of one call; the rest is dropped [bytes]
SPARE_TASKS = 1024  # processes and threads that the user may have beyond those now
MB = 1e6  # bytes

_LENGTH = struct.Struct("!Q")
_CHUNK = 1 << 16
_OUTPUT_CUT = b"\n(more output of this run is dropped)\n"


class Cause(StrEnum):
    """Why a call has no result."""

    RAISED = "raised"
    DIED = "died"
    TIME = "time"
    MEMORY = "memory"
    PROCESSES = "processes"


class CallLostError(ExperimentError):
    """A call ended without a result."""

    def __init__(
        self, cause: Cause, words: str, process: int, exit_code: int | None = None
    ) -> None:
        super().__init__(words)
        self.cause = cause
        self.process = process  # id of the child
        self.exit_code = exit_code  # negative: died of this signal

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        """Pickle all that it was made of: it goes from one process to another."""
        return type(self), (self.cause, str(self), self.process, self.exit_code)


@dataclass(frozen=True, slots=True)
class CallLimits:
    """Limits of a call, counted over the child and all that it starts."""

    time: float  # wall clock [s]
    memory_mb: float  # resident
    processes: int = MAX_PROCESSES


class GuardedProcess:
    """A child process; it executes one call after another until one goes wrong."""

    def __init__(self) -> None:
        adopt_orphans()
        self._before = children(os.getpid())
        down, self._down = os.pipe()
        self._up, up = os.pipe()
        self._output, output = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        parent = os.getpid()
        self.process = os.fork()
        if self.process == 0:
            _serve(parent, down, up, output)
        for descriptor in (down, up, output):
            os.close(descriptor)
        os.set_blocking(self._output, False)
        self._exit_code: int | None = None
        self._room = OUTPUT_LIMIT
        self._speaks = True  # its output is open

    def call(
        self, function: Callable[[Any], Any], argument: Any, limits: CallLimits
    ) -> Any:
        """Call a function of a module in the child.

        Raises:
            CallLostError: If it raises, or the child dies or exceeds a limit; unless
                it only raised, the child has been killed.
        """
        try:
            message = pickle.dumps((function, argument))
            self._room = OUTPUT_LIMIT
            with suppress(BrokenPipeError):  # noticed below
                _write(self._down, message)
            answer = self._answer(limits)
            raised, value = pickle.loads(answer)
        except (pickle.UnpicklingError, ValueError, EOFError, IndexError) as error:
            self.kill()
            words = f"gave a damaged answer ({described(error)})"
            raise CallLostError(Cause.DIED, words, self.process) from error
        except BaseException:
            self.kill()
            raise
        if raised:
            raise CallLostError(Cause.RAISED, str(value), self.process)
        return value

    def is_alone(self) -> bool:
        """Check that the last call left no process behind."""
        return self._all() == {self.process}

    def kill(self) -> None:
        """Kill the child and all that it started."""
        if self._down < 0:
            return
        kill_group(self.process)
        self._has_died(wait=True)
        kill_all(lambda: self._all() - {self.process})
        self._forward_output()
        for descriptor in (self._down, self._up, self._output):
            os.close(descriptor)
        self._down = -1

    def _all(self) -> set[int]:
        """Return the child, all below it, and the orphans that came from it."""
        orphans = children(os.getpid()) - self._before
        if self._exit_code is None:
            orphans |= {self.process}
        return with_descendants(orphans)

    def _answer(self, limits: CallLimits) -> bytes:
        """Wait for the answer of the child while checking the limits."""
        received = bytearray()
        deadline = monotonic() + limits.time
        check = monotonic() + INTERVAL
        while True:
            pipes = (self._up, self._output) if self._speaks else (self._up,)
            ready, _, _ = select.select(pipes, (), (), INTERVAL)
            if self._output in ready:
                self._forward_output()
            ended = self._up in ready and not self._receive(received)
            size = _LENGTH.size
            if len(received) >= size:
                (length,) = _LENGTH.unpack_from(received)
                if len(received) >= size + length:
                    return bytes(received[size : size + length])
            now = monotonic()
            if ended or now >= check:
                check = now + INTERVAL
                self._check(limits, deadline, ended=ended)

    def _receive(self, received: bytearray) -> bool:
        """Read a part of the answer; return whether there may be more."""
        chunk = os.read(self._up, _CHUNK)
        received += chunk
        return bool(chunk)

    def _check(self, limits: CallLimits, deadline: float, *, ended: bool) -> None:
        """Raise CallLostError if the child has died or exceeds a limit."""
        if ended and not self._dies_soon():
            self.kill()
            words = "closed the pipe to the process that watches it"
            raise CallLostError(Cause.DIED, words, self.process, self._exit_code)
        if self._has_died(wait=False):
            words = death_in_words(self._exit_code)
            raise CallLostError(Cause.DIED, words, self.process, self._exit_code)
        found = self._all()
        cause, words = None, ""
        if len(found) > limits.processes:
            cause, words = Cause.PROCESSES, f"had {len(found)} processes"
        elif memory(found, limits.memory_mb * MB) > limits.memory_mb * MB:
            cause = Cause.MEMORY
            words = f"exceeded {limits.memory_mb:.0f} MB of memory"
        elif monotonic() >= deadline:
            cause, words = Cause.TIME, f"exceeded {limits.time:g} s of wall clock"
        if cause is not None:
            self.kill()
            raise CallLostError(cause, words, self.process, self._exit_code)

    def _has_died(self, *, wait: bool) -> bool:
        """Check whether the child has died; `wait`: it has been killed."""
        if self._exit_code is None:
            process, state = os.waitpid(self.process, 0 if wait else os.WNOHANG)
            if process != 0:
                self._exit_code = os.waitstatus_to_exitcode(state)
        return self._exit_code is not None

    def _dies_soon(self) -> bool:
        """Wait for a child whose pipe is closed."""
        deadline = monotonic() + CLOSED_PATIENCE
        while not self._has_died(wait=False) and monotonic() < deadline:
            sleep(0.01)
        return self._exit_code is not None

    def _forward_output(self) -> None:
        """Copy the child's output to this process's, up to the limit of a call."""
        with suppress(BlockingIOError):
            for _ in range(OUTPUT_LIMIT // _CHUNK):  # then look at the limits again
                chunk = os.read(self._output, _CHUNK)
                if not chunk:
                    self._speaks = False
                    return
                kept = chunk[: max(self._room, 0)]
                cut = self._room > 0 and len(chunk) >= self._room
                self._room -= len(chunk)
                with suppress(OSError):  # a full disk is reported by the run
                    os.write(2, kept + (_OUTPUT_CUT if cut else b""))


def death_in_words(exit_code: int | None) -> str:
    """Describe how a process ended, from its exit code."""
    if exit_code is None or exit_code >= 0:
        return f"left with exit status {exit_code} before the end"
    try:
        name = signal.Signals(-exit_code).name
    except ValueError:  # a real-time signal
        name = f"signal {-exit_code}"
    hint = " (as the kernel does when memory runs out)" if name == "SIGKILL" else ""
    return f"died of {name}{hint}"


def _serve(parent: int, down: int, up: int, output: int) -> NoReturn:
    """Execute calls in the child until the parent closes the pipe."""
    try:
        os.setsid()
        end_with_parent(parent)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.dup2(output, 1)
        os.dup2(output, 2)
        _close_others(down, up)
        _limit_tasks()
        while (message := _read(down)) is not None:
            _write(up, _result(message))
    finally:
        os._exit(1)


def _result(message: bytes) -> bytes:
    """Execute one call and return its outcome as the parent reads it."""
    function, argument = pickle.loads(message)
    try:
        outcome = False, function(argument)
    except BaseException as error:  # noqa: BLE001, of anyone's code
        outcome = True, described(error)
    with suppress(BaseException):  # a planner may have replaced these
        sys.stdout.flush()
        sys.stderr.flush()
    return pickle.dumps(outcome)


def _close_others(*kept: int) -> None:
    """Close what the child has no use for: the pipes of the pool."""
    last = 2
    for descriptor in (*sorted(kept), os.sysconf("SC_OPEN_MAX")):
        os.closerange(last + 1, min(descriptor, 65_536))
        last = descriptor


def _limit_tasks() -> None:
    """Limit how many processes and threads the user may have; root has no limit."""
    import resource  # not on Windows

    if os.getuid() == 0:
        return
    tasks = 0
    for process in psutil.process_iter(("uids", "num_threads")):
        uids = process.info["uids"]
        if uids is not None and uids.real == os.getuid():
            tasks += process.info["num_threads"] or 1
    soft, hard = resource.getrlimit(resource.RLIMIT_NPROC)
    limits = [tasks + SPARE_TASKS, *(n for n in (soft, hard) if n >= 0)]
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_NPROC, (min(limits), hard))


def _write(pipe: int, message: bytes) -> None:
    """Write a message with its length."""
    rest = memoryview(_LENGTH.pack(len(message)) + message)
    while rest:
        rest = rest[os.write(pipe, rest) :]


def _read(pipe: int) -> bytes | None:
    """Read a message; None at the end."""
    head = _read_exactly(pipe, _LENGTH.size)
    return None if head is None else _read_exactly(pipe, _LENGTH.unpack(head)[0])


def _read_exactly(pipe: int, size: int) -> bytes | None:
    """Read so many bytes; None at the end."""
    received = bytearray()
    while len(received) < size:
        chunk = os.read(pipe, size - len(received))
        if not chunk:
            return None
        received += chunk
    return bytes(received)
