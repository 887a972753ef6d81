"""Source files of a user's planner: its own, and those it imports from its folder.

Imports are read from the sources, not from what happens to be loaded: a planner may
import as late as in its first cycle. Other installed packages are left out, and this
project's own have the hash of the code.
"""

import sys
from functools import cache
from modulefinder import Module, ModuleFinder
from pathlib import Path
from types import ModuleType
from typing import IO, Any

from experiments.errors import ConfigError
from experiments.storage.provenance import PACKAGES

INSTALLED = ("site-packages", "dist-packages")  # folders that many packages share


@cache
def planner_sources(module_name: str) -> tuple[Path, ...]:
    """Return the source files, sorted; empty for a module without a file.

    Args:
        module_name: Of the planner, already imported.

    Raises:
        ConfigError: If one of the files is no Python.
    """
    module = sys.modules.get(module_name)
    if module is None or getattr(module, "__file__", None) is None:
        return ()
    root = _root(module)
    package = module_name.partition(".")[0]
    finder = _Finder(root, package, alone=root.name in INSTALLED)
    try:
        finder.import_hook(module_name)
    except ImportError:  # within a namespace package, or one of ours by its address
        return (Path(str(module.__file__)),)
    except SyntaxError as error:
        place = f"{error.filename}, line {error.lineno}"
        raise ConfigError(f"planner: {module_name}: {place}: {error.msg}") from error
    files = {getattr(found, "__file__", None) for found in finder.modules.values()}
    return tuple(sorted(Path(file) for file in files if file is not None))


def _root(module: ModuleType) -> Path:
    """Return the folder that holds the module or its package."""
    depth = module.__name__.count(".") + hasattr(module, "__path__")
    return Path(str(module.__file__)).resolve().parents[depth]


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
