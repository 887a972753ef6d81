"""The shape of the code: packages, directions of imports, sizes of functions."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
PACKAGES = ("planner", "sumo_nets", "experiments")
MOST_ARGUMENTS = 8
MOST_LINES = 60  # of a function, its docstring aside
MOST_ROOMS = 20  # packages and root files of experiments


@cache
def trees() -> dict[Path, ast.Module]:
    """Parse all modules, once."""
    return {
        file: ast.parse(file.read_text(encoding="utf-8"))
        for package in PACKAGES
        for file in sorted((ROOT / package).rglob("*.py"))
    }


def functions() -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    for file, tree in trees().items():
        for node in statements(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f"{file.relative_to(ROOT)}:{node.lineno} {node.name}", node


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Find all statements, and what holds statements; no expression holds any."""
    for node in ast.iter_child_nodes(tree):
        if not isinstance(node, ast.expr):
            yield node
            yield from statements(node)


def n_arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    listed = function.args
    named = [*listed.posonlyargs, *listed.args, *listed.kwonlyargs]
    return sum(argument.arg not in ("self", "cls") for argument in named)


def n_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    first, last = function.body[0], function.end_lineno or function.lineno
    documented = ast.get_docstring(function) is not None
    docstring = (first.end_lineno or 0) - first.lineno + 1 if documented else 0
    return last - function.lineno + 1 - docstring


def test_functions_are_short_and_take_few_arguments():
    found = list(functions())
    assert len(found) > 1000  # the walk sees the code at all
    long = [
        f"{place}: {n_arguments(node)} arguments, {n_lines(node)} lines"
        for place, node in found
        if n_arguments(node) > MOST_ARGUMENTS or n_lines(node) > MOST_LINES
    ]
    assert long == []


def test_experiments_has_few_rooms_and_four_files_at_its_root():
    root = ROOT / "experiments"
    files = {file.name for file in root.glob("*.py")}
    assert files == {"__init__.py", "__main__.py", "errors.py", "interrupts.py"}
    packages = {file.parent.name for file in root.glob("*/__init__.py")}
    assert len(packages) + len(files) <= MOST_ROOMS


def test_no_class_name_has_two_meanings():
    places: dict[str, list[str]] = {}
    public = ROOT / "experiments" / "api"  # its names are those of the things inside
    for file, tree in trees().items():
        if file.is_relative_to(public):
            continue
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(str(file.relative_to(ROOT)))
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_imports_make_no_circle_and_are_counted():
    """`make imports` shows the line that this test prints."""
    graph = grimp.build_graph(*PACKAGES)
    imports = {
        module: graph.find_modules_directly_imported_by(module)
        for module in graph.modules
    }
    TopologicalSorter(imports).prepare()  # raises CycleError
    arrows = {
        (room(module), room(target))
        for module, targets in imports.items()
        for target in targets
        if {module.split(".")[0], target.split(".")[0]} == {"experiments"}
        and room(module) != room(target)
    }
    rooms = {name for arrow in arrows for name in arrow}
    above: dict[str, set[str]] = {name: set() for name in rooms}
    for upper, lower in arrows:
        above[upper].add(lower)
    level: dict[str, int] = {}
    for name in TopologicalSorter(above).static_order():
        level[name] = 1 + max((level[lower] for lower in above[name]), default=0)
    print(  # noqa: T201 - the line that make imports shows
        f"experiments: {len(rooms)} rooms, {max(level.values())} levels, "
        f"{len(arrows)} arrows, no circle"
    )
    assert len(rooms) <= MOST_ROOMS


def room(module: str) -> str:
    return ".".join(module.split(".")[:2])
