"""A child process under limits: what it does wrong, and that nothing of it is left."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from experiments.sweep.processes import guarded
from experiments.sweep.processes.guarded import (
    CallLimits,
    CallLostError,
    Cause,
    GuardedProcess,
)
from experiments.sweep.processes.tree import children

LIMITS = CallLimits(time=60.0, memory_mb=2000.0)
ROOT = Path(__file__).parents[4]


@pytest.fixture
def child():
    made = GuardedProcess()
    yield made
    made.kill()


def double(number: int) -> int:
    return 2 * number


def whoami(_: object) -> int:
    return os.getpid()


def leave(status: int) -> None:
    os._exit(status)


def die(number: int) -> None:
    os.kill(os.getpid(), number)


def throw(words: str) -> None:
    raise LookupError(words)


def sleep(seconds: float) -> None:
    time.sleep(seconds)


def fork_and_sleep(count: int) -> None:
    """Fork children that sleep, with their parent."""
    for _ in range(count):
        if os.fork() == 0:
            break
    time.sleep(60.0)
    os._exit(0)


def eat(megabytes: int) -> None:
    kept = bytearray(megabytes * 1_000_000)
    time.sleep(60.0)
    kept.clear()


def eat_twice(megabytes: int) -> None:
    """Divide what is eaten between two processes."""
    os.fork()
    eat(megabytes // 2)


def leave_daemon(_: object) -> int:
    """Leave an orphan in a session of its own; return its process id."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.setsid()
        daemon = os.fork()
        if daemon == 0:
            time.sleep(60.0)
            os._exit(0)
        os.write(writing, str(daemon).encode())
        os._exit(0)
    os.waitpid(child, 0)
    return int(os.read(reading, 20))


def close_pipes(_: object) -> None:
    os.closerange(3, 100)
    time.sleep(60.0)


def shout(size: int) -> None:
    os.write(1, b"x" * size)


def open_files(_: object) -> list[int]:
    """List the descriptors that can be used, apart from those of the protocol."""
    return [int(place.name) for place in Path("/proc/self/fd").iterdir()]


def test_calls_one_after_another_in_the_same_process(child):
    assert child.call(double, 21, LIMITS) == 42
    processes = {child.call(whoami, None, LIMITS) for _ in range(3)}
    assert processes == {child.process}
    assert child.process != os.getpid()
    assert child.is_alone()


def test_what_raises_does_not_end_the_child(child):
    for _ in range(2):
        with pytest.raises(CallLostError, match="LookupError: no such thing") as caught:
            child.call(throw, "no such thing", LIMITS)
        assert caught.value.cause is Cause.RAISED


@pytest.mark.parametrize(
    ("function", "argument", "words", "code"),
    [
        (leave, 3, "left with exit status 3 before the end", 3),
        (die, signal.SIGSEGV, "died of SIGSEGV", -signal.SIGSEGV),
        (die, signal.SIGKILL, r"died of SIGKILL \(as the kernel does", -signal.SIGKILL),
        (die, signal.SIGRTMIN + 2, "died of signal", -signal.SIGRTMIN - 2),
    ],
)
def test_a_child_that_dies(child, function, argument, words, code):
    with pytest.raises(CallLostError, match=words) as caught:
        child.call(function, argument, LIMITS)
    assert caught.value.cause is Cause.DIED
    assert caught.value.exit_code == code


@pytest.mark.parametrize(
    ("function", "argument", "limits", "cause", "words"),
    [
        (
            sleep,
            60.0,
            CallLimits(0.5, 2000.0),
            Cause.TIME,
            "exceeded 0.5 s of wall clock",
        ),
        (eat, 400, CallLimits(60.0, 350.0), Cause.MEMORY, "exceeded 350 MB of memory"),
        (eat_twice, 800, CallLimits(60.0, 700.0), Cause.MEMORY, "exceeded 700 MB"),
        (
            fork_and_sleep,
            6,
            CallLimits(60.0, 2000.0, processes=5),
            Cause.PROCESSES,
            "had [67] processes",
        ),
    ],
)
def test_limits(child, function, argument, limits, cause, words):
    started = time.monotonic()
    with pytest.raises(CallLostError, match=words) as caught:
        child.call(function, argument, limits)
    assert caught.value.cause is cause
    assert time.monotonic() - started < 30.0
    assert not psutil.pid_exists(child.process)
    assert children(os.getpid()) <= child._before


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="orphans are adopted")
def test_a_daemon_is_noticed_and_killed(child):
    daemon = child.call(leave_daemon, None, LIMITS)
    assert psutil.pid_exists(daemon)
    assert not child.is_alone()
    child.kill()
    assert not psutil.pid_exists(daemon)


def test_a_child_that_closes_its_pipes_is_not_waited_for(child):
    started = time.monotonic()
    with pytest.raises(CallLostError, match="closed the pipe") as caught:
        child.call(close_pipes, None, LIMITS)
    assert caught.value.cause is Cause.DIED
    assert time.monotonic() - started < 10.0


def test_output_is_limited_for_each_call(child, capfd, monkeypatch):
    monkeypatch.setattr(guarded, "OUTPUT_LIMIT", 200_000)
    for _ in range(2):
        child.call(shout, 500_000, LIMITS)
    child.kill()
    err = capfd.readouterr().err
    assert 200_000 <= err.count("x") <= 450_000
    assert err.count("more output of this run is dropped") >= 1


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="lists them")
def test_the_child_has_no_other_files_open(child):
    with Path(__file__).open():
        assert len(child.call(open_files, None, LIMITS)) <= 6


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_child_ends_with_its_parent(number):
    script = (
        "from tests.experiments.sweep.processes.test_guarded import *\n"
        "child = GuardedProcess()\n"
        "print(child.process, flush=True)\n"
        "child.call(sleep, 60.0, LIMITS)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        process = int(parent.stdout.readline())
        os.kill(parent.pid, number)
    wait_until(lambda: has_ended(process))


def has_ended(process: int) -> bool:
    """Check for a process; this one may have adopted it, and has not reaped it yet."""
    try:
        return psutil.Process(process).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def limited_tasks(_: object) -> tuple[int, int]:
    """Set the limit as for a user who is not root and has no other process."""
    os.getuid = lambda: 54_321
    guarded._limit_tasks()
    return resource.getrlimit(resource.RLIMIT_NPROC)


def test_a_user_who_is_not_root_may_have_so_many_more_tasks(child):
    before = resource.getrlimit(resource.RLIMIT_NPROC)
    soft, hard = child.call(limited_tasks, None, LIMITS)
    assert soft == guarded.SPARE_TASKS
    assert hard == before[1]
    assert resource.getrlimit(resource.RLIMIT_NPROC) == before
