"""The compiled functions that each planner family calls, with types of arguments.

`kernels.json` lists them, so that they can be compiled before they are needed, and in
several processes at once. What the list lacks is compiled when it is called. After a
change of arguments, `python -m experiments.cli.kernel_list` drives the shipped
scenarios and writes the list anew.
"""

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from numba.core import types

from planner.numerics.kernel_content import content
from planner.numerics.linking import Kernel

FILE = Path(__file__).with_name("kernels.json")
# What calls every function of a family, among them (scenario, planner).
DRIVES = {
    "cruise": [
        ("straight", "cruise"),
        ("intersection", "cruise_conventional"),
        ("u_shaped", "cruise"),
        ("dense", "cruise"),
    ],
    "dense": [
        ("dense", "dense"),
        ("dense_curved", "dense_adaptive"),
        ("dense", "dense_uniform"),
    ],
    "lane_change": [
        ("lane_change", "lane_change"),
        ("lane_change_curved", "lane_change_area"),
        ("lane_change_three", "lane_change_dp"),
        ("straight", "lane_change"),
        ("cut_in", "lane_change"),  # with fallbacks
    ],
}
Signature = list[Any]  # function as module:name, then its arguments, as JSON


@cache
def kernel_list() -> dict[str, list[Signature]]:
    """Read the functions of each family."""
    listed: dict[str, list[Signature]] = json.loads(FILE.read_text(encoding="utf-8"))
    return listed


def family_of(planner: str) -> str | None:
    """Return the family of a registered planner, None for others."""
    # not needed, and slow to import, where functions are compiled
    from experiments.planners.registry import PLANNERS

    known = PLANNERS.get(planner)
    name = known.factory.partition(":")[0].split(".")[1] if known else None
    return name if name in DRIVES else None


def missing(families: Sequence[str]) -> list[Signature]:
    """Return what is not compiled yet, the largest functions first."""
    found: dict[str, tuple[int, Signature]] = {}
    for signature in (each for name in families for each in kernel_list()[name]):
        kernel, arguments = _kernel(signature)
        if kernel is not None and not kernel._cache.is_filled(arguments):
            size = len(content(kernel))
            found[json.dumps(signature)] = size, signature
    return [each for _, each in sorted(found.values(), key=lambda item: -item[0])]


def compile_one(signature: Signature) -> None:
    """Compile one function into the cache."""
    kernel, arguments = _kernel(signature)
    if kernel is not None:
        kernel.compile(arguments)


def _kernel(signature: Signature) -> tuple[Any, tuple[Any, ...]]:
    """Find a listed function; None if it is not compiled, or no longer there."""
    try:
        kernel = _named(signature[0])
        arguments = tuple(_type(each) for each in signature[1:])
    except (ImportError, AttributeError):
        return None, ()
    return kernel if isinstance(kernel, Kernel) else None, arguments


def _named(name: str) -> Any:
    """Find what has a name."""
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _type(word: Any) -> Any:
    """Read the type of an argument."""
    if isinstance(word, str):
        return getattr(types, word)
    kind, *rest = word
    if kind == "array":
        dtype, ndim, layout, frozen = rest
        return types.Array(getattr(types, dtype), ndim, layout, readonly=frozen)
    if kind == "omitted":
        return types.misc.Omitted(rest[0])
    record = _named(rest[0]) if kind == "record" else None
    inside = rest if record is None else rest[1:]
    return types.containers.BaseTuple.from_types(
        [_type(each) for each in inside], record
    )


def _words(kind: Any) -> Any:
    """Write the type of an argument, as `_type` reads it.

    Raises:
        TypeError: If the type cannot be listed.
    """
    if isinstance(kind, types.Array):
        return ["array", _words(kind.dtype), kind.ndim, kind.layout, not kind.mutable]
    if isinstance(kind, types.misc.Omitted):
        return ["omitted", kind.value]
    if isinstance(kind, types.containers.BaseTuple):
        inside = [_words(each) for each in kind]
        record = getattr(kind, "instance_class", None)
        if record is None:
            return ["tuple", *inside]
        return ["record", f"{record.__module__}:{record.__qualname__}", *inside]
    name = "boolean" if kind == types.boolean else str(kind)
    if getattr(types, name, None) != kind:
        raise TypeError(f"{kind} cannot be listed")
    return name


def called_now() -> Iterator[Signature]:
    """List what Python has called in this process so far."""
    for name, module in sorted(sys.modules.items()):
        if name.partition(".")[0] not in ("planner", "experiments"):
            continue
        for attribute, value in sorted(vars(module).items()):
            if isinstance(value, Kernel) and value.py_func.__module__ == name:
                for arguments in value.overloads:
                    yield [f"{name}:{attribute}", *map(_words, arguments)]


def drive(family: str) -> list[Signature]:
    """Drive the scenarios of a family; list the functions that were called."""
    from experiments.config.scenario_file import load_scenario
    from experiments.episode.drive import run_scenario
    from experiments.episode.run_folder import OutputOptions

    output = OutputOptions(keeps_candidates=True)  # as `rearview run` does
    with TemporaryDirectory() as folder:
        for scenario, planner in DRIVES[family]:
            loaded = load_scenario(scenario, planner=planner, seed=0)
            run_scenario(loaded, out=Path(folder), output=output)
    return sorted(called_now(), key=json.dumps)


def _main(families: Sequence[str]) -> None:
    """Write the list, each family driven in a process of its own; print one family."""
    if families:
        sys.stdout.write(json.dumps(drive(families[0])) + "\n")
        return
    listed = {}
    for family in DRIVES:
        command = [sys.executable, "-m", "experiments.cli.kernel_list", family]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
        listed[family] = json.loads(done.stdout.splitlines()[-1])
    lines = [
        f'"{family}": [\n' + ",\n".join(map(json.dumps, each)) + "\n]"
        for family, each in listed.items()
    ]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    _main(sys.argv[1:])
