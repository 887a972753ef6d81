"""The tables of docs/planners against the code."""

import re
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path

import pytest

import planner
from planner.cruise import CruiseSettings, conventional, costs, proposed
from planner.cruise.feasibility import Check
from planner.interface import PlanStatus

PAGES = "".join(
    (Path(planner.__file__).parents[1] / "docs/planners" / name).read_text("utf-8")
    for name in ("index.md", "cruise.md")
)


def section(title):
    found = re.search(rf"^#+ {title}$(.*?)(?=^#|\Z)", PAGES, re.DOTALL | re.MULTILINE)
    assert found, title
    return found[1]


def rows(text):
    """First two cells of every row whose first cell is code."""
    return dict(
        re.findall(r"^\| `([\w.]+)` \| ((?:\\\||[^|])*?) \|", text, re.MULTILINE)
    )


def written(value):
    if value is None:
        return "of the vehicle"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(str(part) for part in value)
    return value.value if isinstance(value, Enum) else str(value)


def flat(record, prefix=""):
    for field in fields(record):
        value = getattr(record, field.name)
        if is_dataclass(value):
            yield from flat(value, f"{field.name}.")
        else:
            yield prefix + field.name, written(value)


def test_the_default_settings():
    assert rows(section("Default settings")) == dict(flat(CruiseSettings()))


@pytest.mark.parametrize(
    ("name", "made"), [("proposed", proposed()), ("conventional", conventional())]
)
def test_the_cost_sets(name, made):
    weights = made.settings.weights
    three = (weights.jerk, weights.safety, weights.offset)
    start = " / ".join(f"{value:g}" if value == 0 else str(value) for value in three)
    assert rows(section("Cost sets"))[name].startswith(start)


def test_every_check_and_term_has_a_row():
    cruising = rows(section("One cycle"))
    checks = {check.name.lower() for check in Check} - {"passed"}
    assert set(cruising) == checks | set(costs.TERMS)


def test_every_status_has_a_row():
    assert set(rows(section("Fallback ladder"))) == {str(value) for value in PlanStatus}
