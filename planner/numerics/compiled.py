"""The two ways that planner code is compiled, both by numba and cached on disk."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import numba

OPTIONS = {"cache": True, "error_model": "numpy"}
F = TypeVar("F", bound=Callable[..., object])


def _fresh_cache_dir() -> str:
    """Name a cache folder after the planner's sources.

    numba notices a change in a function's own file only; a changed callee in
    another file would leave a stale caller behind.
    """
    root = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for source in sorted(root.rglob("*.py")):
        digest.update(source.read_bytes())
    name = f"compiled-{digest.hexdigest()[:12]}"
    home = Path(os.environ.get("HOME", "/nonexistent"))
    for place in (root, home):
        if os.access(place, os.W_OK):
            inside = "__pycache__" if place is root else ".cache/rearview"
            return str(place / inside / name)
    return str(Path(tempfile.gettempdir()) / f"rearview-{os.getuid()}" / name)


if not numba.config.CACHE_DIR:
    numba.config.CACHE_DIR = _fresh_cache_dir()


def compiled(function: F) -> F:
    """Compile `function` to machine code at its first call.

    Division by zero gives inf or nan as in numpy; floating point is not
    reordered, so that results are the same on every run.
    """
    return cast(F, numba.njit(**OPTIONS)(function))


def inlined(function: F) -> F:
    """Compile `function` as `compiled` does, and put it into each compiled caller.

    For what hot loops call: a loop around it can become vector instructions, and no
    references to arrays are counted for a call. Each caller takes longer to compile.
    """
    return cast(F, numba.njit(forceinline=True, **OPTIONS)(function))
