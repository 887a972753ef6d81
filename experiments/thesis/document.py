"""The document `thesis.md`, written from the numbers file and nothing else."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from experiments.storage.markdown_table import markdown_table
from experiments.thesis import wording

Data = Mapping[str, Any]

INTRODUCTION = """# The thesis, recomputed

What "Enhanced Techniques in Path Planning and Optimization for Autonomous Vehicles
across Diverse Traffic Conditions" says in its chapters on planning, beside what this
code measures. `make thesis` writes this file; every number in it stands in
`thesis.json` beside it, and nothing is typed in by hand.

The thesis does not give its layouts. Those called *picked* were chosen among random
ones because their outcome lies near the published one: they are examples. Evidence is
the share of random layouts in which a claim holds, with Wilson's interval. A claim
holds if it holds in all of them, and mostly does not hold if in a tenth or fewer."""


def document(numbers: Data) -> str:
    """Write the whole document."""
    parts = [INTRODUCTION, _summary(numbers), *_slips(numbers)]
    for chapter in numbers["chapters"]:
        parts += [f"## {_heading(chapter)}", _effort(chapter)]
        parts += [_claims(chapter["claims"])]
        parts += [_table(table) for table in chapter["tables"]]
        parts += [f"Not measured: {words}." for words in chapter["missing"]]
    parts += _beyond(numbers)
    parts += _timing(numbers)
    return "\n\n".join(part for part in parts if part) + "\n"


def _summary(numbers: Data) -> str:
    """Count the verdicts."""
    found = numbers["verdicts"]
    words = ", ".join(f"{found[v]} {v}" for v in found)
    start = "Computed with `--quick`, from few layouts. " if numbers["quick"] else ""
    return f"{start}Claims: {words}."


def _slips(numbers: Data) -> Iterator[str]:
    """Yield the section on misprints of the thesis."""
    yield "## Slips of the thesis"
    rows = [
        (
            slip["place"],
            f"{wording.number(slip['printed'])} {slip['unit']}",
            f"{wording.number(slip['right'])} {_unit(slip)}",
            slip["why"],
        )
        for slip in numbers["slips"]
    ]
    yield _grid(("place", "printed", "follows from the rest", "why"), rows)


def _unit(slip: Data) -> str:
    """Return the unit of the right value; a number of waypoints has none."""
    return "" if "waypoints" in slip["why"] else str(slip["unit"])


def _heading(chapter: Data) -> str:
    """Return the heading of a chapter."""
    return f"Chapter {chapter['number']}: {chapter['title']}"


def _effort(chapter: Data) -> str:
    """Describe how much was computed."""
    return "Computed: " + wording.pairs(chapter["effort"]) + "."


def _claims(claims: Sequence[Data]) -> str:
    """Format claims as a table."""
    rows = [
        (
            f"{claim['words']} ({claim['place']})",
            wording.pairs(claim["published"]),
            wording.measured(claim),
            wording.verdict(claim),
            wording.reason(claim),
        )
        for claim in claims
    ]
    return _grid(("claim", "published", "measured", "verdict", "why"), rows)


def _table(table: Data) -> str:
    """Format one table of results."""
    parts = [f"### {table['title']}", _grid(table["header"], table["rows"])]
    return "\n\n".join([*parts, table["note"]] if table["note"] else parts)


def _beyond(numbers: Data) -> Iterator[str]:
    """Yield the section on the thesis's future work."""
    tables = [table for chapter in numbers["chapters"] for table in chapter["beyond"]]
    if tables:
        yield "## Beyond the thesis: its future work (7.1.1)"
    yield from map(_table, tables)


def _timing(numbers: Data) -> Iterator[str]:
    """Yield the section on times."""
    timing = numbers["timing"]
    if not timing["chapters"]:
        return
    yield "## Times, measured on one machine"
    machine = timing["machine"]
    yield (
        f"On {machine['processor']}, {machine['system']}, Python {machine['python']}, "
        "while other programs may have run. These numbers differ from run to run and "
        "from machine to machine; all others come out the same every time."
    )
    for chapter in timing["chapters"]:
        if chapter["claims"]:
            yield _claims(chapter["claims"])
        yield from map(_table, chapter["tables"])


def _grid(header: Sequence[str], rows: Sequence[Sequence[float | str]]) -> str:
    """Format a table whose cells may be numbers."""
    return markdown_table(header, [[wording.number(c) for c in row] for row in rows])
