"""The page `report.html`: claims, pictures and tables in one file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.report.html import PAGE_FILE, render, save
from experiments.thesis import wording
from experiments.thesis.drawing import data_uri

Data = Mapping[str, Any]
MARKS = {"holds": "good", "mostly does not hold": "bad", "does not hold": "bad"}


def save_thesis_page(
    numbers: Data, pictures: Mapping[int, Sequence[Data]], out: Path
) -> Path:
    """Write the page.

    Args:
        numbers: As `thesis.json` holds them.
        pictures: Of each chapter.
        out: Its folder.

    Returns:
        The page's file.
    """
    return save(thesis_page(numbers, pictures), out / PAGE_FILE)


def thesis_page(numbers: Data, pictures: Mapping[int, Sequence[Data]]) -> str:
    """Build the page."""
    chapters = numbers["chapters"]
    timed = numbers["timing"]["chapters"]
    facts = {
        "quick": numbers["quick"],
        "counts": numbers["verdicts"],
        "slips": numbers["slips"],
        "chapters": [
            {
                "number": chapter["number"],
                "title": chapter["title"],
                "effort": wording.pairs(chapter["effort"]),
                "claims": _claims(chapter["claims"]),
                "tables": chapter["tables"],
                "missing": chapter["missing"],
                "pictures": [
                    {"title": picture["title"], "source": data_uri(picture)}
                    for picture in pictures[chapter["number"]]
                ],
            }
            for chapter in chapters
        ],
        "beyond": [table for chapter in chapters for table in chapter["beyond"]],
        "machine": numbers["timing"]["machine"],
        "timing_claims": [c for one in timed for c in _claims(one["claims"])],
        "timing": [table for one in timed for table in one["tables"]],
        "number": wording.number,
    }
    return render("thesis.html.j2", ("thesis.js",), None, facts)


def _claims(claims: Sequence[Data]) -> list[dict[str, str]]:
    """Format claims."""
    return [
        {
            "words": claim["words"],
            "place": claim["place"],
            "published": wording.pairs(claim["published"]),
            "measured": wording.measured(claim),
            "verdict": wording.verdict(claim),
            "kind": str(claim["verdict"]),
            "mark": MARKS.get(claim["verdict"], ""),
            "reason": wording.reason(claim),
        }
        for claim in claims
    ]
