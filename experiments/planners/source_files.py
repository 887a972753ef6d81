"""Source files of a user's planner: its own, and those it imports from its folder.

Imports are read from the sources, not from what happens to be loaded: a planner may
import as late as in its first cycle. Nothing is imported for it either: that could
take this process down. Other installed packages are left out, and this
project's own have the hash of the code.
"""

import sys
from collections.abc import Sequence
from functools import cache
from importlib.machinery import ModuleSpec
from modulefinder import Module, ModuleFinder
from pathlib import Path
from typing import IO, Any

from experiments.errors import ConfigError
from experiments.storage.provenance import PACKAGES

INSTALLED = ("site-packages", "dist-packages")  # folders that many packages share


@cache
def planner_sources(module_name: str) -> tuple[Path, ...]:
    """Return the source files, sorted; empty for a module without a file.

    Args:
        module_name: Of the planner.

    Raises:
        ConfigError: If one of the files is no Python.
    """
    spec = _find(module_name)
    if spec is None or spec.origin is None or not spec.has_location:
        return ()
    root = _root(spec)
    package = module_name.partition(".")[0]
    finder = _Finder(root, package, alone=root.name in INSTALLED)
    try:
        finder.import_hook(module_name)
    except ImportError:  # within a namespace package, or one of ours by its address
        return (Path(spec.origin),)
    except SyntaxError as error:
        place = f"{error.filename}, line {error.lineno}"
        raise ConfigError(f"planner: {module_name}: {place}: {error.msg}") from error
    files = {getattr(found, "__file__", None) for found in finder.modules.values()}
    return tuple(sorted(Path(file) for file in files if file is not None))


def _find(module_name: str) -> ModuleSpec | None:
    """Find a module without importing it or the packages around it."""
    parts = module_name.split(".")
    spec: ModuleSpec | None = None
    for depth in range(1, len(parts) + 1):
        places = None if spec is None else spec.submodule_search_locations
        if depth > 1 and places is None:
            return None
        spec = _first_spec(".".join(parts[:depth]), places)
        if spec is None:
            return None
    return spec


def _first_spec(name: str, places: Sequence[str] | None) -> ModuleSpec | None:
    """Ask every finder of this process for a module."""
    for finder in sys.meta_path:
        find = getattr(finder, "find_spec", None)
        spec: ModuleSpec | None = find(name, places) if find else None
        if spec is not None:
            return spec
    return None


def _root(spec: ModuleSpec) -> Path:
    """Return the folder that holds the module or its package."""
    depth = spec.name.count(".") + (spec.submodule_search_locations is not None)
    return Path(str(spec.origin)).resolve().parents[depth]


class _Finder(ModuleFinder):
    """Follows imports within one folder, or within one installed package."""

    def __init__(self, root: Path, package: str, *, alone: bool) -> None:
        super().__init__(path=[str(root)], excludes=PACKAGES)
        self._package, self._alone = package, alone

    def find_module(
        self, name: str, path: str | None, parent: Module | None = None
    ) -> tuple[IO[Any] | None, str | None, tuple[str, str, int]]:
        """Skip other installed packages, and packages without a file."""
        if self._alone and path is None and name != self._package:
            raise ImportError(name)
        try:
            return super().find_module(name, path, parent)
        except AttributeError:  # modulefinder does not know namespace packages
            raise ImportError(name) from None
