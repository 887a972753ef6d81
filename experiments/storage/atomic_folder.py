"""Folders and files that exist complete or not at all.

A folder is filled under a temporary name beside its place and then renamed whole.
"""

import os
import shutil
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from pathlib import Path
from socket import gethostname

from experiments.errors import ResultsError

PARENTS = (Path("sweeps"), Path("runs"))  # where commands put results by default
LIKE = 0.75  # from which two names are alike, 0 to 1
# Files that are waited for at a time: a disk writes them in one go, where one after the
# other takes 5 ms each.
AT_ONCE = 8


def _process_space() -> int:
    """Name the processes among which ids are unique.

    Containers with the same host name have their own.
    """
    try:
        return Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        return 0


_ASIDE = f".unfinished-{gethostname()}.{_process_space()}-"  # then the process


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """Fill a temporary folder and rename it to the target when the block succeeds.

    A folder that was there is replaced; if anything fails, it stays and nothing of
    the new one is left.

    Args:
        target: The folder to be.

    Yields:
        The folder to fill.

    Raises:
        ResultsError: If the disk refuses: full, read-only, no such place.
    """
    target = target.absolute()  # a planner may change the working folder
    make_folder(target.parent)
    remove_abandoned(target.parent)
    try:
        aside = _make_aside(target.parent)
    except OSError as error:
        raise ResultsError(f"{target.parent}: {_reason(error)}") from error
    try:
        yield aside
        _put(aside, target)
    except OSError as error:
        raise ResultsError(f"{target}: cannot be written: {_reason(error)}") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def write_atomically(file: Path, text: str) -> None:
    """Write a temporary file and rename it, so that the target is never partial.

    Raises:
        ResultsError: If it cannot be written, for example on a full disk.
    """
    aside = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(file)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise ResultsError(f"{file}: cannot be written: {_reason(error)}") from error


def make_folder(folder: Path) -> None:
    """Create a folder and its parents unless it exists.

    Raises:
        ResultsError: If a file is in its place, or the disk refuses.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        file = file_in_place_of(folder)
        is_link = file is not None and file.is_symlink() and not file.exists()
        kind = "a link to nowhere" if is_link else "a file"
        raise ResultsError(f"{file}: is {kind}; allowed: a folder") from error
    except OSError as error:
        raise ResultsError(f"{folder}: {_reason(error)}") from error


def require_there(folder: Path) -> None:
    """Raise a ResultsError if a folder is missing: a mistyped name, most likely."""
    if folder.exists():
        return
    close = _folder_like(folder)
    hint = "" if close is None else f"; did you mean {close}?"
    raise ResultsError(f"{folder}: there is no such folder{hint}")


def _folder_like(missing: Path) -> Path | None:
    """Find a folder that may be meant: of this name in `PARENTS`, or of one like it."""
    if not missing.is_absolute():
        for parent in PARENTS:
            if (parent / missing).is_dir():
                return parent / missing
    try:
        there = [one.name for one in missing.parent.iterdir() if one.is_dir()]
    except OSError:
        return None
    close = get_close_matches(missing.name, there, n=1, cutoff=LIKE)
    return missing.with_name(close[0]) if close else None


def file_in_place_of(folder: Path) -> Path | None:
    """Return a file in the place of a folder or one of its parents; None if absent."""
    for place in (folder, *folder.parents):
        if place.exists():
            return None if place.is_dir() else place
        if place.is_symlink():  # to nowhere
            return place
    return None


def remove_unfinished(parent: Path, process: int) -> None:
    """Remove the unfinished folders of a dead process."""
    for left in _asides(parent):
        if _filled_by(left) == process:
            shutil.rmtree(left, ignore_errors=True)


def remove_abandoned(parent: Path) -> None:
    """Remove the unfinished folders of this machine's dead processes, as of kill -9."""
    for left in _asides(parent):
        from psutil import pid_exists  # takes 20 ms, which is seldom needed

        process = _filled_by(left)
        if process is not None and not pid_exists(process):
            shutil.rmtree(left, ignore_errors=True)


def _asides(parent: Path) -> list[Path]:
    """List the unfinished folders of this machine."""
    with suppress(OSError), os.scandir(parent) as entries:
        return [Path(one.path) for one in entries if one.name.startswith(_ASIDE)]
    return []


def _filled_by(aside: Path) -> int | None:
    """Return the process that fills an unfinished folder, if its name says so."""
    process = aside.name.removeprefix(_ASIDE).partition("-")[0]
    return int(process) if process.isdecimal() else None


def _make_aside(parent: Path) -> Path:
    """Create a folder under a temporary name."""
    return Path(tempfile.mkdtemp(prefix=f"{_ASIDE}{os.getpid()}-", dir=parent))


def _put(aside: Path, target: Path) -> None:
    """Rename the finished folder once its files are on the disk."""
    aside.chmod(0o777 & ~_umask())
    with ThreadPoolExecutor(AT_ONCE) as pool:
        list(pool.map(_flush, aside.iterdir()))
    if not target.exists():
        aside.rename(target)
        return
    old = _make_aside(target.parent)
    try:
        target.rename(old / "old")
        try:
            aside.rename(target)
        except OSError:
            (old / "old").rename(target)
            raise
    finally:
        with suppress(OSError):
            shutil.rmtree(old)


def _flush(file: Path) -> None:
    """Wait until a file is on the disk."""
    descriptor = os.open(file, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _umask() -> int:
    """Read the process's umask, which can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _reason(error: OSError) -> str:
    """Return the message of an error of the operating system."""
    return error.strerror or str(error)
