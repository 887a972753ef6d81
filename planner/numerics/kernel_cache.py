"""Machine code on disk, found by what it was made of.

The name of a file is a hash of the entry's code, of every function and constant that it
reaches, of the types of its arguments, the processor and the compiler's release. So a
changed line makes anew what depends on it and nothing else, and wherever a copy of the
project lies, it finds what another one compiled. Nothing stale can be found.
"""

import contextlib
import hashlib
import io
import logging
import os
import pickle
import sys
import tempfile
import time
import uuid
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
import numpy as np
from numba.core import sigutils
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.environment import Environment, lookup_environment
from numba.core.runtime import rtsys

from planner.numerics import linking
from planner.numerics.kernel_content import UnknownContentError, content, type_content
from planner.numerics.linking import EntryLibrary

log = logging.getLogger(__name__)

PACKAGE_FOLDER = Path(__file__).parents[1] / "_kernels"  # travels with the package
SUFFIX = ".kernel"
_FORMAT = "1"  # of the files
_DIGEST = hashlib.sha256().digest_size
_OLD = 60 * 86_400.0  # a file that nobody read for so long is deleted [s]
_DAY = 86_400.0  # how exactly the time of reading is kept [s]


class KernelCache(_Cache):  # type: ignore[misc]  # numba has no types
    """Loads and saves the machine code of one function, for any types of arguments."""

    def __init__(self, kernel: Any) -> None:
        self._kernel = kernel

    @property
    def cache_path(self) -> str:
        """The folder that is written to first."""
        return str(folders()[0])

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return compiled code for types of arguments, None if there is none."""
        name = self.file_name(sig)
        for folder in reading_order() if name else ():
            payload = _read(folder / str(name))
            if payload is not None:
                rtsys.initialize(target_context)  # what restored code calls
                return _restored(payload, target_context)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save what was compiled, where a folder can be written."""
        name = self.file_name(sig)
        if name is None or data.library.has_dynamic_globals or data.lifted:
            return
        payload = pickle.dumps(_reduced(data))
        _write(name, hashlib.sha256(payload).digest() + payload)

    def file_name(self, sig: Any) -> str | None:
        """Return the name of the file; None if what it is made of is not known."""
        args, _ = sigutils.normalize_signature(sig)
        try:
            made_of = [*content(self._kernel), *map(type_content, args), *_compiler()]
        except UnknownContentError as error:
            log.debug("%s is not cached: %s", self._kernel, error)
            return None
        digest = hashlib.sha256("\0".join(made_of).encode()).hexdigest()[:32]
        function = self._kernel.py_func
        words = f"{function.__module__}.{function.__qualname__}"
        return words.replace("<", "").replace(">", "") + f"-{digest}{SUFFIX}"

    def is_filled(self, sig: Any) -> bool:
        """Check whether there is a file for types of arguments."""
        name = self.file_name(sig)
        return name is None or any(
            (folder / name).is_file() for folder in reading_order()
        )

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing, as above."""

    def flush(self) -> None:
        """Do nothing: no file can be out of date."""


def folders() -> list[Path]:
    """Return where machine code may be written, best place first."""
    if numba.config.CACHE_DIR:
        return [Path(numba.config.CACHE_DIR)]
    home = os.environ.get("XDG_CACHE_HOME") or Path(
        os.environ.get("HOME", "/nonexistent"), ".cache"
    )
    temporary = Path(tempfile.gettempdir()) / f"rearview-{os.getuid()}"
    return [Path(home) / "rearview" / "kernels", PACKAGE_FOLDER, temporary]


def is_writable() -> bool:
    """Check whether what is compiled can be kept."""
    for folder in folders():
        try:
            _prepare(folder)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return True
    return False


def reading_order() -> list[Path]:
    """Return where machine code is looked for: also in the package itself."""
    return list(dict.fromkeys([*folders(), PACKAGE_FOLDER]))


@lru_cache(maxsize=1)
def _compiler() -> tuple[str, ...]:
    """Describe compiler and processor."""
    return (
        numba.__version__,
        llvmlite.__version__,
        np.__version__,
        repr(linking.Kernel.targetdescr.target_context.codegen().magic_tuple()),
        repr([numba.config.OPT, numba.config.LOOP_VECTORIZE, numba.config.BOUNDSCHECK]),
        hashlib.sha256(Path(linking.__file__).read_bytes()).hexdigest(),
        _FORMAT,
    )


def _reduced(result: Any) -> tuple[Any, ...]:
    """Return what a compiled function can be restored from."""
    result.fndesc.typemap = result.fndesc.calltypes = None
    environments = tuple(result._find_referenced_environments())
    code = (result.library.name, *result.library.object_and_symbols())
    return (
        code,
        result.fndesc,
        result.environment,
        result.signature,
        result.reload_init,
        environments,
    )


def _restored(payload: bytes, target_context: Any) -> Any:
    """Make a compiled function of what was saved."""
    code, fndesc, environment, signature, reload_init, environments = _Restorer(
        io.BytesIO(payload)
    ).load()
    for initialise in reload_init:
        initialise()
    library = EntryLibrary.from_object(target_context.codegen(), *code)
    entry_point = target_context.get_executable(library, fndesc, environment)
    for each in environments:
        library.codegen.set_env(each.env_name, each)
    return CompileResult(
        typing_context=target_context.typing_context,
        target_context=target_context,
        entry_point=entry_point,
        typing_error=None,
        type_annotation="",
        signature=signature,
        objectmode=False,
        lifted=(),
        fndesc=fndesc,
        library=library,
        call_helper=None,
        environment=environment,
        metadata=None,
        reload_init=reload_init,
        referenced_envs=environments,
    )


class _Restorer(pickle.Unpickler):
    """Restores what was saved, without importing where each part of it came from."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a class or function, our own for environments."""
        if (module, name) == ("numba.core.environment", "_rebuild_env"):
            return _environment
        return super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Environment:
    """Return the constants that a compiled function refers to, as numba does.

    Numba imports the module of the function, too: those of its own are large, one of
    them imports scipy's linear algebra, and machine code looks nothing up in them.
    """
    found = lookup_environment(name)
    if found is not None:
        return found
    known = sys.modules.get(module)
    made = Environment({"__name__": module} if known is None else vars(known))
    made.consts[:] = constants
    made.env_name = name
    Environment._memo[name] = made
    return made


def _read(file: Path) -> bytes | None:
    """Read what was saved; None if there is nothing, or nothing whole."""
    try:
        written = file.read_bytes()
        if time.time() - file.stat().st_mtime > _DAY:
            with contextlib.suppress(OSError):  # a folder of somebody else
                os.utime(file)
    except OSError:
        return None
    payload = written[_DIGEST:]
    if hashlib.sha256(payload).digest() == written[:_DIGEST]:
        return payload
    _say_once(f"{file.parent} has damaged files: what they held is compiled again")
    return None


def _write(name: str, written: bytes) -> None:
    """Write a file at once, so that other processes see all of it or nothing."""
    failure: OSError | None = None
    for folder in folders():
        partial = folder / f"{name}.{uuid.uuid4().hex[:8]}"
        try:
            _prepare(folder)
            partial.write_bytes(written)
            partial.replace(folder / name)
        except OSError as error:
            failure = failure or error
            with contextlib.suppress(OSError):
                partial.unlink()
        else:
            return
    where = folders()[0]
    why = failure.strerror if failure and failure.strerror else failure
    _say_once(f"compiled loops cannot be kept in {where} ({why}): each run compiles")


def _prepare(folder: Path) -> None:
    """Make a folder, if it is ours to write to.

    Raises:
        PermissionError: If it belongs to another user, whom we do not trust with code.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if folder.stat().st_uid not in (os.getuid(), 0):
        raise PermissionError(f"{folder} is another user's")
    _forget_old(folder)


@lru_cache(maxsize=8)
def _forget_old(folder: Path) -> None:
    """Delete what nobody read for long, once a process."""
    for file in folder.glob(f"*{SUFFIX}*"):
        with contextlib.suppress(OSError):
            if time.time() - file.stat().st_mtime > _OLD:
                file.unlink()


@lru_cache(maxsize=8)
def _say_once(text: str) -> None:
    """Warn once a process."""
    log.warning("%s", text)
