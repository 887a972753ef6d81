"""The two ways that planner code is compiled, both by numba and cached on disk.

A disk that is full or read-only costs the cache only: that is said once on stderr, and
everything is compiled in memory.
"""

import hashlib
import os
import pickle
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])
_CACHE_ERRORS = (OSError, EOFError, pickle.UnpicklingError)
NEEDED = 4096  # bytes that must fit into a cache folder [-]


def _cache_dir() -> str:
    """Find a folder for the cache; empty text if none can be written.

    It is named after the planner's sources: numba notices a change in a function's own
    file only; a changed callee in another file would leave a stale caller behind.
    """
    if numba.config.CACHE_DIR:  # NUMBA_CACHE_DIR
        places = [Path(numba.config.CACHE_DIR)]
    else:
        root = Path(__file__).parent.parent
        digest = hashlib.sha256()
        for source in sorted(root.rglob("*.py")):
            digest.update(source.read_bytes())
        name = f"compiled-{digest.hexdigest()[:12]}"
        home = Path(os.environ.get("HOME", "/nonexistent"))
        temporary = Path(tempfile.gettempdir()) / f"rearview-{os.getuid()}"
        inside = (root / "__pycache__", home / ".cache/rearview", temporary)
        places = [place / name for place in inside]
    problems: list[OSError] = []
    for place in places:
        try:
            place.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place) as file:
                file.write(bytes(NEEDED))
                file.flush()
        except OSError as error:
            problems.append(error)
        else:
            return str(place)
    _warn_once(places[0], problems[0])
    return ""


def _warn_once(place: Path | str, problem: Exception) -> None:
    """Report that compiled code is not kept, the first time only."""
    if _warned:
        return
    _warned.append(str(place))
    reason = getattr(problem, "strerror", None) or type(problem).__name__
    sys.stderr.write(
        f"rearview: {place}: {reason}; compiled code is not kept there, every start "
        "compiles again\n"
    )


_warned: list[str] = []
numba.config.CACHE_DIR = _cache_dir()
OPTIONS = {"cache": bool(numba.config.CACHE_DIR), "error_model": "numpy"}


def compiled(function: F) -> F:
    """Compile `function` to machine code at its first call.

    Division by zero gives inf or nan as in numpy; floating point is not
    reordered, so that results are the same on every run.
    """
    return cast(F, _without_cache_errors(numba.njit(**OPTIONS)(function)))


def inlined(function: F) -> F:
    """Compile `function` as `compiled` does, and put it into each compiled caller.

    For what hot loops call: a loop around it can become vector instructions, and no
    references to arrays are counted for a call. Each caller takes longer to compile.
    """
    made = numba.njit(forceinline=True, **OPTIONS)(function)
    return cast(F, _without_cache_errors(made))


def _without_cache_errors(dispatcher: Any) -> Any:
    """Make a compiled function go on where its cache cannot be read or written.

    numba lets the errors of a full disk, and of a file that is cut short, end the call.
    """
    cache = getattr(dispatcher, "_cache", None)  # numba may be switched off
    if cache is None or not OPTIONS["cache"]:
        return dispatcher
    load, save = cache.load_overload, cache.save_overload

    def load_overload(*arguments: object) -> object:
        try:
            return load(*arguments)
        except _CACHE_ERRORS as error:
            _warn_once(cache.cache_path, error)
            return None

    def save_overload(*arguments: object) -> None:
        try:
            save(*arguments)
        except _CACHE_ERRORS as error:
            _warn_once(cache.cache_path, error)

    cache.load_overload, cache.save_overload = load_overload, save_overload
    return dispatcher
