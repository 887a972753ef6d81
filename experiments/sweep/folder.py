"""The folder of a sweep: lock, finished runs, version of the code.

sweep.yaml       the sweep file
code.json        hashes of the code and of users' planners, versions of libraries
runs/ab/abcd.../ one folder per run, under the first two characters of its id
results.parquet  one row per run, rebuilt from the run folders
progress.json    progress
workers.log      output of SUMO and planners
reruns/abcd...   repeated runs, with their full trace
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
from pydantic import ValidationError

from experiments.config.sweep import Sweep
from experiments.config.yaml_reader import read_document
from experiments.errors import ConfigError, ResultsError
from experiments.storage.atomic_folder import (
    file_in_place_of,
    make_folder,
    require_there,
    write_atomically,
)
from experiments.storage.json_files import (
    FileSchema,
    checked,
    first_mistake,
    read_json,
)
from experiments.storage.run_files import MANIFEST, replace_json
from experiments.sweep.search.files import ASKED

SHARD = 2  # characters of the id that name the folder above the run's
RESULTS = "results.parquet"
PROGRESS = "progress.json"
LOG = "workers.log"
RERUNS = "reruns"  # folder of repeated runs
_SWEEP, _CODE, _LOCK = "sweep.yaml", "code.json", ".lock"


class CodeFile(FileSchema):
    """Which sweep a folder belongs to, and the code of its runs."""

    sweep: str
    code: dict[str, str]


def run_folder(folder: Path, run_id: str) -> Path:
    """Return the folder of a run."""
    return folder / "runs" / run_id[:SHARD] / run_id


def run_folders(folder: Path) -> Iterator[Path]:
    """Yield the run folders of a sweep, sorted; every folder is complete."""
    runs = folder / "runs"
    for shard in sorted(_folders(runs)):
        yield from sorted(_folders(shard))


def finished(folder: Path) -> set[str]:
    """Return the ids of the finished runs."""
    return {run.name for run in run_folders(folder)}


def is_sweep(folder: Path) -> bool:
    """Check whether a folder is the folder of a sweep."""
    return (folder / "runs").is_dir() and (folder / _SWEEP).is_file()


def require_sweep(folder: Path) -> None:
    """Raise an error unless a folder is there and is that of a sweep."""
    require_there(folder)
    ours = any((folder / name).is_file() for name in (_SWEEP, ASKED))
    if ours and not (folder / "runs").exists():
        raise ConfigError(f"{folder}: has no finished run yet; run the sweep again")
    if not (ours and (folder / "runs").is_dir()):
        raise ConfigError(
            f"{folder}: is not the folder of a sweep; allowed: a folder written by "
            "rearview sweep or rearview search"
        )


def require_place(folder: Path) -> None:
    """Reject a folder in which a sweep would mix with something else.

    Args:
        folder: Where it is to be; absolute. A folder that is not there, an empty one
            and one that a sweep was in are fine.

    Raises:
        ConfigError: If the folder holds something else.
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
    """Describe a folder that is not of a sweep; empty text if it is empty."""
    if (folder / MANIFEST).is_file():
        return "is the folder of a single run"
    count = sum((inner / MANIFEST).is_file() for inner in _folders(folder))
    if count:
        return f"holds single runs ({count}), no sweep"
    names = sorted(e.name for e in folder.iterdir() if not e.name.startswith("."))
    return f"holds something else ({names[0]})" if names else ""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder against other sweeps; the lock ends with the process.

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
                f"{folder}: in use by another sweep ({owner}); allowed: another --out, "
                "or wait"
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
    """Initialise the folder of a sweep, or resume in it.

    Args:
        folder: Locked.
        sweep: The sweep; it may have more or other runs than before.
        code: Hashes of the code and of the users' planners, versions of libraries.

    Raises:
        ConfigError: If the folder belongs to another sweep, or its runs came from
            another version of the code; they stay as they are.
        ResultsError: If the folder cannot be written.
    """
    code_file = folder / _CODE
    before = None
    if code_file.exists():
        before = checked(CodeFile, read_json(code_file), code_file)
        if before.sweep != sweep.name:
            raise ConfigError(
                f"{folder}: belongs to the sweep {before.sweep}; allowed for "
                f"{sweep.name}: another --out"
            )
        _check_code(folder, before.code, code)
    remove_unfinished(folder)
    asked = sweep.model_dump(mode="json", exclude_none=True)
    write_atomically(folder / _SWEEP, yaml.safe_dump(asked, sort_keys=False))
    known = {**(before.code if before else {}), **code}
    replace_json(code_file, {"sweep": sweep.name, "code": known})


def has_sweep_copy(folder: Path) -> bool:
    """Check whether the sweep file of the last call is there."""
    return (folder / _SWEEP).is_file()


def load_sweep_copy(folder: Path) -> Sweep:
    """Read the sweep file of the last call."""
    path = folder / _SWEEP
    try:
        return Sweep.model_validate(read_document(path).data, strict=False)
    except ValidationError as error:
        raise ResultsError(f"{path}: is damaged: {first_mistake(error)}") from error
    except ConfigError as error:
        raise ResultsError(str(error)) from error


def code_of(folder: Path) -> dict[str, str]:
    """Read which code the runs are of: its hash, users' planners, libraries."""
    path = folder / _CODE
    return checked(CodeFile, read_json(path), path).code


def remove_unfinished(folder: Path) -> None:
    """Remove unfinished run folders of dead processes.

    One of them may be alive on another machine: its folder goes out of its hands
    before it is emptied, or it could be put in its place half empty.
    """
    for left in (folder / "runs").glob("*/.unfinished-*"):
        doomed = left.with_name(f".unfinished-{uuid.uuid4().hex}")
        with suppress(FileNotFoundError):  # it has just been renamed to its target
            left.rename(doomed)
        shutil.rmtree(doomed, ignore_errors=True)


def _check_code(
    folder: Path, before: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Reject mixing the results of two versions of the code."""
    changed = [key for key in now if key in before and before[key] != now[key]]
    count = len(finished(folder)) if changed else 0
    if count:
        raise ConfigError(
            f"{folder}: its {count} runs are of another version of {changed[0]} "
            f"({before[changed[0]][:8]}, now {now[changed[0]][:8]}) and stay as they "
            "are; allowed: another --out, or the version they were made with"
        )


def _folders(parent: Path) -> list[Path]:
    """List the folders in a folder, without unfinished ones."""
    try:
        with os.scandir(parent) as entries:
            return [
                Path(entry.path)
                for entry in entries
                if entry.is_dir() and not entry.name.startswith(".")
            ]
    except FileNotFoundError:
        return []
