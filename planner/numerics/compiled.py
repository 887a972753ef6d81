"""The two ways that planner code is compiled, both by numba and cached on disk."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

from planner.numerics.kernel_cache import KernelCache
from planner.numerics.linking import Kernel

F = TypeVar("F", bound=Callable[..., object])

_OPTIONS = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def compiled(function: F) -> F:
    """Compile `function` to machine code at its first call.

    Division by zero gives inf or nan as in numpy; floating point is not
    reordered, so that results are the same on every run.
    """
    return _kernel(function, _OPTIONS)


def inlined(function: F) -> F:
    """Compile `function` as `compiled` does, and put it into each compiled caller.

    For what hot loops call: a loop around it can become vector instructions, and no
    references to arrays are counted for a call. Each caller takes longer to compile.
    """
    return _kernel(function, {**_OPTIONS, "forceinline": True})


def _kernel(function: F, options: dict[str, object]) -> F:
    """Make a function that numba compiles; without compilation, the function itself."""
    if numba.config.DISABLE_JIT:
        return function
    kernel = Kernel(function, targetoptions=dict(options))
    kernel._cache = KernelCache(kernel)
    return cast(F, kernel)
