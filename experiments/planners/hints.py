"""Hints for planners that are named as a file instead of as `module:factory`."""

import ast
from pathlib import Path


def file_hint(name: str) -> str | None:
    """Return what a user who named a file may have meant.

    Args:
        name: As given: `my_planner.py`, `folder/my_planner.py:make`, `my_planner`.

    Returns:
        A hint with the factories of the file, which is read and not run; None if there
        is no such file.
    """
    given, _, factory = name.partition(":")
    file = Path(given) if given.endswith(".py") else Path(f"{given}.py")
    if not file.is_file():
        return None
    offered = _offered(file)
    chosen = factory if factory in offered or not offered else offered[0]
    if not chosen:
        return f"{file} defines no function or class; allowed: module:factory"
    meant = f"{file.stem}:{chosen}"
    if file.parent != Path():
        meant = f"{meant} in the folder {file.parent}"
    return f"did you mean {meant}? {file} offers {', '.join(offered) or 'nothing'}"


def _offered(file: Path) -> list[str]:
    """List the functions and classes of a file, the likeliest factory first."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return []
    found = [
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        and not node.name.startswith("_")
    ]
    return sorted(found, key=lambda name: not name.startswith("make"))
