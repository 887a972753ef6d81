"""Claims in words, from plain data; every number is written as JSON writes it."""

import json
from collections.abc import Mapping
from typing import Any

Data = Mapping[str, Any]


def number(value: float | str) -> str:
    """Write a cell: numbers as in the numbers file, words as they are."""
    return value if isinstance(value, str) else json.dumps(value)


# the last word of a name that is the unit of its number
UNITS = {"percent": "%", "m": "m", "ms": "ms", "s": "s", "m/s": "m/s", "mps": "m/s"}


def pairs(values: Mapping[str, float]) -> str:
    """Write named numbers in one line, with their units; a dash for none."""
    return "; ".join(_phrase(name, v) for name, v in values.items()) or "-"


def _phrase(name: str, value: float) -> str:
    """Write one named number: `decline: 63.7 %` for `decline percent`."""
    words, _, last = name.rpartition(" ")
    if last in UNITS and words:
        return f"{words}: {number(value)} {UNITS[last]}"
    return f"{name}: {number(value)}"


def verdict(claim: Data) -> str:
    """Describe whether a claim holds, and where."""
    share = claim["share"]
    if share is None:
        return str(claim["verdict"])
    trials = f"{number(share['of'])} {share['trials']}"
    interval = f"{number(share['low'])} to {number(share['high'])} %"
    if claim["verdict"] == "does not hold":
        words = f"does not hold in any of {trials} (0 to {number(share['high'])} %)"
    elif claim["verdict"] == "holds":
        words = f"holds in all {trials} ({interval})"
    elif claim["verdict"] == "mostly does not hold":
        words = f"mostly does not hold: in {number(share['percent'])} % of {trials} "
        words += f"({interval})"
    else:
        words = f"holds in {number(share['percent'])} % of {trials} ({interval})"
    return words + picked(claim)


def picked(claim: Data) -> str:
    """Describe the outcome on the layouts of the numbers, if judged."""
    if claim["picked"] is None:
        return ""
    return f"; {claim['on']}: {'yes' if claim['picked'] else 'no'}"


def measured(claim: Data) -> str:
    """Write what was measured, and on what."""
    return f"{pairs(claim['measured'])} ({claim['on']})"


def reason(claim: Data) -> str:
    """Return why a claim does not hold everywhere; empty if it holds."""
    return "" if claim["verdict"] == "holds" else str(claim["reason"])


def counts(chapters: list[Data]) -> dict[str, int]:
    """Count the verdicts of all claims that do not depend on the machine."""
    found: dict[str, int] = {}
    for chapter in chapters:
        for claim in chapter["claims"]:
            found[claim["verdict"]] = found.get(claim["verdict"], 0) + 1
    return found
