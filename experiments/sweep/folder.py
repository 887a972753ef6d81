"""The folder of a sweep: who works in it, what is finished, of which code.

sweep.yaml       what was asked for
code.json        what made the runs: hashes of the code and of users' planners,
                 versions of libraries
runs/ab/abcd.../ one folder a run, under the first two characters of its id
results.parquet  one row a run, rebuilt from the run folders
progress.json    how far it is
workers.log      what SUMO and planners print
reruns/abcd...   runs that were done again, with their whole trace
report.html      the page of the sweep
"""

import fcntl
import os
import shutil
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import yaml

from experiments.config.sweep import Sweep
from experiments.errors import ConfigError, ResultsError
from experiments.storage.atomic_folder import (
    file_in_place_of,
    make_folder,
    write_atomically,
)
from experiments.storage.run_files import MANIFEST, read_json, replace_json

SHARD = 2  # characters of the id that name the folder above the run's
RESULTS = "results.parquet"
PROGRESS = "progress.json"
LOG = "workers.log"
RERUNS = "reruns"  # folder of the runs that were done again
_SWEEP, _CODE, _LOCK = "sweep.yaml", "code.json", ".lock"


def run_folder(folder: Path, run_id: str) -> Path:
    """Say where the folder of a run is."""
    return folder / "runs" / run_id[:SHARD] / run_id


def run_folders(folder: Path) -> Iterator[Path]:
    """Find the run folders of a sweep, sorted; a folder that is there is whole."""
    runs = folder / "runs"
    for shard in sorted(_folders(runs)):
        yield from sorted(_folders(shard))


def finished(folder: Path) -> set[str]:
    """List the ids of the runs that are there."""
    return {run.name for run in run_folders(folder)}


def is_sweep(folder: Path) -> bool:
    """Tell whether a folder is one that a sweep was in."""
    return (folder / "runs").is_dir() and (folder / _SWEEP).is_file()


def require_sweep(folder: Path) -> None:
    """Refuse a folder that no sweep was in."""
    if not (folder / "runs").is_dir():
        raise ConfigError(f"{folder}: is no folder of a sweep: it has no runs")


def require_place(folder: Path) -> None:
    """Refuse a place where a sweep would mix with something else.

    Args:
        folder: Where it is to be; absolute. A folder that is not there, an empty one
            and one that a sweep was in are fine.

    Raises:
        ConfigError: Says what is there.
    """
    file = file_in_place_of(folder)
    if file is not None:
        raise ConfigError(f"{file}: is a file; allowed: a folder for the sweep")
    ours = any((folder / name).is_file() for name in (_SWEEP, _CODE))
    found = _contents(folder) if folder.is_dir() and not ours else ""
    if found and not any(
        run == run_folder(folder, run.name) for run in run_folders(folder)
    ):
        raise ConfigError(
            f"{folder}: {found}; allowed: a folder that is new, empty or of a sweep"
        )


def _contents(folder: Path) -> str:
    """Say what a folder that no sweep was in is or holds; nothing if it is empty."""
    if (folder / MANIFEST).is_file():
        return "is the folder of a single run"
    count = sum((inner / MANIFEST).is_file() for inner in _folders(folder))
    if count:
        return f"holds single runs ({count}), no sweep"
    names = sorted(e.name for e in folder.iterdir() if not e.name.startswith("."))
    return f"holds something else ({names[0]})" if names else ""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other sweeps out of a folder; a process that dies lets go of it.

    Raises:
        ConfigError: If another sweep works in it.
        ResultsError: If the folder cannot be made.
    """
    make_folder(folder)
    try:
        lock = (folder / _LOCK).open("a+", encoding="utf-8")
    except OSError as error:
        raise ResultsError(f"{folder}: {error.strerror}") from error
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.seek(0)
            owner = lock.read().strip() or "another process"
            raise ConfigError(
                f"{folder}: another sweep is at work in it ({owner}); allowed: "
                "another --out, or wait"
            ) from None
        except OSError as error:  # a file system without locks
            raise ResultsError(
                f"{folder}: cannot be locked: {error.strerror}"
            ) from error
        lock.truncate(0)
        lock.write(f"process {os.getpid()} on {os.uname().nodename}")
        lock.flush()
        yield


def take(folder: Path, sweep: Sweep, code: Mapping[str, Any]) -> None:
    """Make a folder this sweep's, or go on in it.

    Args:
        folder: Locked.
        sweep: What is asked for; it may ask for more or other runs than before.
        code: Hashes of the code and of the users' planners, versions of libraries.

    Raises:
        ConfigError: If the folder belongs to another sweep, or its runs came from
            another version of the code; they stay as they are.
        ResultsError: If the folder cannot be written.
    """
    code_file = folder / _CODE
    before = read_json(code_file) if code_file.exists() else None
    if before is not None:
        if before["sweep"] != sweep.name:
            raise ConfigError(
                f"{folder}: belongs to the sweep {before['sweep']}; allowed for "
                f"{sweep.name}: another --out"
            )
        _check_code(folder, before["code"], code)
    remove_unfinished(folder)
    asked = sweep.model_dump(mode="json", exclude_none=True)
    write_atomically(folder / _SWEEP, yaml.safe_dump(asked, sort_keys=False))
    known = {**(before["code"] if before else {}), **code}
    replace_json(code_file, {"sweep": sweep.name, "code": known})


def load_sweep_copy(folder: Path) -> Sweep:
    """Read what was asked for when the folder was last worked in."""
    path = folder / _SWEEP
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
        return Sweep.model_validate(data, strict=False)
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error


def remove_unfinished(folder: Path) -> None:
    """Remove what processes that died left of their run folders.

    One of them may be alive on another machine: its folder goes out of its hands
    before it is emptied, or it could be put in its place half empty.
    """
    for left in (folder / "runs").glob("*/.unfinished-*"):
        doomed = left.with_name(f".unfinished-{uuid.uuid4().hex}")
        with suppress(FileNotFoundError):  # it has just been put in its place
            left.rename(doomed)
        shutil.rmtree(doomed, ignore_errors=True)


def _check_code(
    folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Refuse to mix the results of two versions of the code."""
    changed = [key for key in now if key in before and before[key] != now[key]]
    count = len(finished(folder)) if changed else 0
    if count:
        raise ConfigError(
            f"{folder}: its {count} runs are of another version of {changed[0]} "
            f"({before[changed[0]][:8]}, now {now[changed[0]][:8]}) and stay as they "
            "are; allowed: another --out, or the version they were made with"
        )


def _folders(parent: Path) -> list[Path]:
    """List the folders in a folder, without those that are being filled."""
    try:
        with os.scandir(parent) as entries:
            return [
                Path(entry.path)
                for entry in entries
                if entry.is_dir() and not entry.name.startswith(".")
            ]
    except FileNotFoundError:
        return []
