"""Which modules a scenario or sweep file may name as its planner.

Importing a module runs its code, and its factory gets whatever settings the file has:
`os:system` would run any command of a file that somebody else wrote. A file may
therefore name only a module that lies beside it, or one of this project. Any other has
to be named on the command line.
"""

import sys
from collections.abc import Collection
from importlib.machinery import PathFinder
from pathlib import Path

from experiments.errors import ConfigError
from experiments.storage.provenance import PACKAGES

ALLOW_PLANNER = "--allow-planner"
OWN_MODULES = frozenset({"rearview.peers"})  # whose factories run nothing but planners
_INSTALLED = ("site-packages", "dist-packages")


def require_allowed(
    name: str, where: str, folder: Path, allowed: Collection[str]
) -> Path | None:
    """Check that a file may name a planner, and make the planner's module findable.

    Args:
        name: Of the planner: registered, or `module:factory`.
        where: Where it was written, for the message.
        folder: Of the file.
        allowed: Modules that the user allows on the command line; a package allows
            the modules inside.

    Returns:
        The folder to import the module from; None if it is not beside the file.

    Raises:
        ConfigError: If the module is not beside the file nor allowed.
    """
    module, colon, _ = name.partition(":")
    if not colon or module in OWN_MODULES:
        return None
    if any(f"{module}.".startswith(f"{one}.") for one in allowed):
        return None
    folder = folder.absolute()
    if not _is_beside(module, folder):
        hint = f"{folder / module.replace('.', '/')}.py, or {ALLOW_PLANNER} {module}"
        raise ConfigError(
            f"{where}: planner: {name}: a file may not name the module {module}, "
            f"whose code would run: it is not beside the file; allowed: {hint}"
        )
    search_in(folder)
    return folder


def search_in(folder: Path) -> None:
    """Search a folder for planners' modules, before all others."""
    if sys.path[:1] != [str(folder)]:
        sys.path.insert(0, str(folder))


def _is_beside(module: str, folder: Path) -> bool:
    """Check that a module is a file in a folder, and that no other has its name."""
    parts = module.split(".")
    if not all(part.isidentifier() for part in parts):
        return False
    top = parts[0]
    if top in sys.stdlib_module_names or top in PACKAGES or _is_installed(top):
        return False
    place = folder.joinpath(*parts)
    files = (place.with_name(f"{place.name}.py"), place / "__init__.py")
    return any(file.is_file() for file in files)


def _is_installed(top: str) -> bool:
    """Check for an installed package of a name, which may be loaded already."""
    folders = [place for place in sys.path if Path(place).name in _INSTALLED]
    return PathFinder.find_spec(top, folders) is not None
