"""Execution on other machines, by dask.distributed.

Each thread of a dask worker has an isolated process for its runs, the same as the local
executor's: time-out, memory ceiling and crashes are dealt with where they happen. Run
folders are written by the workers themselves, into a folder that all machines see.
"""

import asyncio
import multiprocessing
import re
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock
from time import monotonic
from typing import Any

from experiments.episode.identity import code_hash, shaping_versions
from experiments.errors import ConfigError, ExecutorError
from experiments.sweep.executors.executor import WorkerSettings
from experiments.sweep.executors.isolation import IsolatedWorkers
from experiments.sweep.task import Failure, RunReport, RunTask, failed

try:
    import dask
    from distributed import (
        CancelledError,
        Client,
        Future,
        KilledWorker,
        LocalCluster,
        get_worker,
    )
except ImportError as error:
    raise ConfigError(
        f"a sweep on a cluster needs dask ({error}): pip install distributed"
    ) from error

ADDRESS = re.compile(r"\w+://[^/]+:(?P<port>\d+)")
MAX_PORT = 65_535
ALLOWED_ADDRESS = (
    "allowed: tcp://host:8786, for example (rearview cluster starts one here)"
)
CONNECT_PATIENCE = 10.0  # [s]
COUNT_INTERVAL = 1.0  # between two queries of the workers [s]
NO_WORKER_PATIENCE = 60.0  # without any worker, before the sweep stops [s]
WORKER_PAGE = "127.0.0.1:0"  # of each worker, which would listen everywhere
DAEMON = "distributed.worker.daemon"
# daemonic processes cannot have children, and a run needs one
DAEMON_HINT = "DASK_DISTRIBUTED__WORKER__DAEMON=false"

STOP_PATIENCE = 1.0  # between two checks whether the sweep was stopped [s]
IDLE_PATIENCE = 300.0  # after which the processes of an ended sweep are stopped [s]


@dataclass(slots=True)
class _Kept:
    """Processes that a dask worker keeps for a sweep."""

    pool: IsolatedWorkers
    busy: int = 0  # running episodes
    used: float = field(default_factory=monotonic)  # when last [s]


_pools: dict[str, _Kept] = {}  # of this dask worker, by sweep
_pools_lock = Lock()


class ClusterExecutor:
    """Executes runs on the workers of a dask scheduler."""

    def __init__(self, address: str, settings: WorkerSettings, folder: Path) -> None:
        """Connect to the scheduler and check its workers.

        Raises:
            ConfigError: If no scheduler answers, it has no workers, or they cannot do
                this sweep's runs.
        """
        self._address = address
        self._settings = settings
        self._key = uuid.uuid4().hex
        self._client = _connect(address)
        self._futures: dict[object, Future[Any]] = {}
        self._over: SimpleQueue[tuple[RunTask, Future[Any]]] = SimpleQueue()
        self._threads, self._seen_worker = 0, monotonic()
        self._counted = -COUNT_INTERVAL
        try:
            self._check_workers(folder)
        except BaseException:
            self._client.close()
            raise

    @property
    def workers(self) -> int:
        """Current number of threads of all workers."""
        now = monotonic()
        if now - self._counted > COUNT_INTERVAL:
            self._counted = now
            self._count_threads()
        return max(1, self._threads)

    def submit(self, task: RunTask) -> None:
        """Submit a run to the scheduler."""
        key = f"{task.run_id}-{task.attempt}-{self._key}"
        future = self._client.submit(
            _drive_here, task, self._settings, self._key, key=key, pure=False
        )
        self._futures[key] = future
        future.add_done_callback(lambda future: self._over.put((task, future)))

    def next_report(self, patience: float) -> RunReport | None:
        """Wait for a run to finish.

        Raises:
            ExecutorError: If the scheduler or all workers are lost.
        """
        try:
            task, future = self._over.get(timeout=patience)
        except Empty:
            self._check_alive()
            return None
        self._futures.pop(future.key, None)
        try:
            report: RunReport = future.result()
        except KilledWorker as error:
            words = f"every worker that executed the run was lost: {error}"
            return failed(task, Failure.LOST_WORKER, words)
        except (CancelledError, asyncio.CancelledError):
            self._check_alive()
            return failed(task, Failure.LOST_WORKER, "the scheduler dropped the run")
        except Exception as error:  # noqa: BLE001, of the worker, not of the run
            words = f"{type(error).__name__}: {error}"
            return failed(task, Failure.LOST_WORKER, words)
        return report

    def stop(self) -> None:
        """Cancel everything, including running episodes, and disconnect."""
        if self._client.status == "running":
            self._client.cancel(list(self._futures.values()), force=True)
            self._client.run(_close_pool, self._key, on_error="ignore")
        self._client.close()

    def _check_alive(self) -> None:
        """Raise ExecutorError if no worker has been available for too long."""
        if self._client.status != "running":
            raise self._lost()
        self._count_threads()
        if monotonic() - self._seen_worker > NO_WORKER_PATIENCE:
            raise ExecutorError(
                f"{self._address}: no worker for {NO_WORKER_PATIENCE:.0f} s; the same "
                "command resumes the sweep"
            )

    def _count_threads(self) -> None:
        """Query the number of worker threads from the scheduler."""
        try:
            threads: Mapping[str, int] = self._client.nthreads()
        except (OSError, TimeoutError) as error:  # distributed's errors are OSErrors
            raise self._lost() from error
        self._threads = sum(threads.values())
        if self._threads:
            self._seen_worker = monotonic()

    def _lost(self) -> ExecutorError:
        """Build the error for a scheduler that no longer answers."""
        return ExecutorError(
            f"{self._address}: the scheduler is lost; the same command resumes the "
            "sweep"
        )

    def _check_workers(self, folder: Path) -> None:
        """Reject missing workers, and workers with other code or another disk."""
        if not self._client.nthreads():
            raise ConfigError(f"--cluster {self._address}: has no workers")
        token = folder / f".seen-{self._key}"
        token.touch()
        try:
            found = self._client.run(_about_worker, token)
        finally:
            token.unlink()
        for worker, (code, versions, sees, daemon) in found.items():
            here = shaping_versions()
            if code != code_hash():
                problem = "has another version of the code"
            elif versions != here:
                problem = f"has {_listed(versions)}; allowed: {_listed(here)}, as here"
            elif not sees:
                problem = (
                    f"does not see {folder}; allowed: a folder shared by all machines"
                )
            elif daemon:
                problem = f"is a daemon; start workers with {DAEMON_HINT}"
            else:
                continue
            raise ConfigError(f"--cluster {self._address}: worker {worker} {problem}")


def require_scheduler(address: str) -> None:
    """Raise ConfigError if no scheduler answers at an address."""
    _connect(address).close()


@contextmanager
def local_cluster(workers: int, port: int, dashboard: str) -> Iterator[str]:
    """Start a scheduler and workers on this machine.

    Args:
        workers: Processes with one thread each.
        port: Of the scheduler, 0 for any.
        dashboard: HOST:PORT of dask's page.

    Yields:
        The scheduler's address.
    """
    with (
        dask.config.set({DAEMON: False}),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            scheduler_port=port,
            dashboard_address=dashboard,
            worker_dashboard_address=WORKER_PAGE,
        ) as cluster,
    ):
        yield cluster.scheduler_address


def _connect(address: str) -> Client:
    """Connect to a scheduler."""
    found = ADDRESS.fullmatch(address)
    if found is None or int(found["port"]) > MAX_PORT:
        raise ConfigError(f"--cluster {address}: is not an address; {ALLOWED_ADDRESS}")
    try:
        return Client(address, timeout=CONNECT_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        words = f"no dask scheduler answers there; {ALLOWED_ADDRESS}"
        raise ConfigError(f"--cluster {address}: {words}") from error


def _about_worker(token: Path) -> tuple[str, dict[str, str | None], bool, bool]:
    """Return, on a worker, the facts that decide whether it can execute runs."""
    daemon = bool(multiprocessing.current_process().daemon)
    return code_hash(), shaping_versions(), token.exists(), daemon


def _listed(versions: Mapping[str, str | None]) -> str:
    """Format versions of libraries."""
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def _drive_here(task: RunTask, settings: WorkerSettings, key: str) -> RunReport:
    """Execute a run in an isolated process of this dask worker."""
    report: SimpleQueue[RunReport] = SimpleQueue()
    kept = _borrow(settings, key)
    try:
        kept.pool.drive(task, report.put)
        while True:
            with suppress(Empty):
                return report.get(timeout=STOP_PATIENCE)
            if kept.pool.stopped:
                return failed(task, Failure.LOST_WORKER, "the sweep was stopped")
    finally:
        with _pools_lock:
            kept.busy -= 1
            kept.used = monotonic()


def _borrow(settings: WorkerSettings, key: str) -> _Kept:
    """Return this dask worker's processes for a sweep, and end those long unused."""
    with _pools_lock:
        for other, kept in list(_pools.items()):
            idle = kept.busy == 0 and monotonic() - kept.used > IDLE_PATIENCE
            if other != key and idle:
                _pools.pop(other).pool.stop()
        if key not in _pools:
            threads: Any = get_worker().state.nthreads
            _pools[key] = _Kept(IsolatedWorkers(int(threads), settings))
        _pools[key].busy += 1
        return _pools[key]


def _close_pool(key: str) -> None:
    """Stop this dask worker's processes of a sweep."""
    with _pools_lock:
        kept = _pools.pop(key, None)
    if kept is not None:
        kept.pool.stop()
