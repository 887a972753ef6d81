"""The study in words and tables: a page and a Markdown document of the same content."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from experiments.cosim.plants.tracked import PlantSettings
from experiments.evidence.r157.drivers import CAREFUL_HUMAN, TITLES
from experiments.evidence.r157.figure import draw_panels, save_panels
from experiments.evidence.r157.grids import ConflictKind, Density
from experiments.evidence.r157.planner_runs import RunSettings
from experiments.evidence.r157.summary import (
    Headline,
    KindStudy,
    counts_rows,
    preventable_cells,
)
from experiments.report.html import PAGE_FILE, render, save
from experiments.storage.atomic_folder import write_atomically
from experiments.storage.run_files import replace_json

DOCUMENT: Final = "r157.md"
NUMBERS: Final = "r157.json"
MOST_ROWS: Final = 25  # of the table of preventable collisions in the document
KINDS: Final[Mapping[ConflictKind, str]] = {
    ConflictKind.CUT_IN: "Cut-in",
    ConflictKind.CUT_OUT: "Cut-out",
    ConflictKind.BRAKING: "Braking leader",
}
CAVEATS: Final = (
    "The models are written from the published equations. Where these leave something "
    "open (a delay lasts whole steps and counts in danger only, positions advance with "
    "the speed at the end of a step, between two dangers the speed is held) they "
    "follow the conventions of the implementation published with Mattas et al. (2022), "
    "github.com/ec-jrc/JRC-FSM. On the thinned grids of six pairs of speeds (60/20, "
    "60/50, 50/10, 40/10, 90/40, 130/70 km/h) all 24 counts equal those of that "
    "implementation, cell by cell.",
    "Some lateral speeds reach the ego's side exactly at a step of 0.1 s: in such a "
    "cell rounding decides (Vy of 12 times 0.1 m/s takes a step longer to reach than "
    "one of 1.2 m/s).",
    "The careful human judges a cut-in once, when the vehicles begin to overlap "
    "laterally. With more than 2 s to the collision the case counts as not critical "
    "and ends without a collision.",
    "The formula of 5.2.5.2 is one for cut-ins; it is left out of the other kinds.",
    "The other vehicle keeps its speed and moves sideways at a constant speed, as in "
    "the regulation. Which cells come out unpreventable depends on this choice (de "
    "Gelder and Op den Camp, arXiv 2409.01117); --profile quintic moves it smoothly.",
    "Reference drivers are simulated with rectangles compared at each step of 0.1 s; "
    "a planner also collides if it touches between two steps. A reference driver run "
    "as a planner therefore collides in a few more cells at the border.",
    "The reference drivers only brake. A planner may also steer: a cell that it "
    "survives by leaving its lane says nothing about its braking, and the lanes beside "
    "it are empty but for the other vehicle.",
)


def write_study(
    studies: Sequence[KindStudy], density: Density, settings: RunSettings, out: Path
) -> Path:
    """Write pictures, numbers, document and page into a folder.

    Args:
        studies: At least one.
        density: Of the grids.
        settings: Of the runs.
        out: The folder.

    Returns:
        The page's file.

    Raises:
        ResultsError: If the disk refuses.
    """
    sections = [_section(study, settings, out) for study in studies]
    replace_json(
        out / NUMBERS,
        {
            "grid": str(density),
            "settings": _settings_words(settings),
            "kinds": sections,
        },
    )
    facts = {
        "conditions": _grid_words(density, settings),
        "sections": sections,
        "caveats": CAVEATS,
    }
    write_atomically(out / DOCUMENT, _markdown(facts))
    for section in sections:
        for name in ("headline", "preventable"):
            section[f"{name}_rows"] = [list(row.values()) for row in section[name]]
        for picture in section["pictures"]:
            encoded = base64.b64encode((out / picture["file"]).read_bytes())
            picture["source"] = f"data:image/png;base64,{encoded.decode('ascii')}"
    return save(render("r157.html.j2", (), None, facts), out / PAGE_FILE)


def _section(study: KindStudy, settings: RunSettings, out: Path) -> dict[str, Any]:
    """Draw the pictures of a kind and collect its tables."""
    planners: Sequence[str | None] = list(study.runs) or [None]
    pictures = []
    for planner in planners:
        runs = study.runs[planner] if planner else ()
        slug = "" if planner is None else "_" + planner.replace(":", "-")
        file = f"r157_{study.kind}{_variant(settings)}{slug}.png"
        save_panels(draw_panels(study.results, runs), out / file)
        who = planner or "the reference drivers"
        pictures.append({"title": f"{KINDS[study.kind]}: {who}", "file": file})
    rows = counts_rows(study.results, study.runs)
    names = [name for name in rows[0] if name not in ("panel", "cells")]
    uncritical = sum(r.uncritical[CAREFUL_HUMAN] for r in study.results)
    return {
        "title": KINDS[study.kind],
        "kind": str(study.kind),
        "pictures": pictures,
        "headline": [_headline_row(h, settings) for h in study.headlines()],
        "header": ["panel", "cells", *(TITLES.get(n, n) for n in names)],
        "rows": [
            [row["panel"], row["cells"], *(row[n] for n in names)] for row in rows
        ],
        "uncritical": uncritical,
        "preventable": [
            cell
            for runs in study.runs.values()
            for cell in preventable_cells(study.results, runs, settings)
        ],
    }


def _variant(settings: RunSettings) -> str:
    """Return what tells pictures with these settings from those without, or ''."""
    follower = "_follower" if settings.follower else ""
    return follower + (f"_{settings.plant.model}" if settings.plant else "")


def _headline_row(found: Headline, settings: RunSettings) -> dict[str, Any]:
    """Return the headline of a planner as a row of a table."""
    row = {
        "planner": found.planner,
        "collisions the careful human prevents": found.preventable,
        "survived of his collisions": f"{found.survived} of {found.unpreventable} "
        f"({found.share})",
        "collisions in all": f"{found.collisions} of {found.cells}",
        "failed": found.failed,
        "left its lane": found.left_lane,
        "braked > 6 m/s²": found.braked_hard,
        "hardest braking [m/s²]": f"{found.hardest_braking:.1f}",
    }
    if settings.follower:
        row["hardest braking behind [m/s²]"] = f"{found.follower_braking:.1f}"
        row["hit from behind"] = found.follower_hits
    return row


def _settings_words(settings: RunSettings) -> dict[str, Any]:
    """Return the settings as JSON."""
    return {
        "profile": str(settings.profile),
        "follower": settings.follower,
        "plant": None if settings.plant is None else asdict(settings.plant),
    }


def _grid_words(density: Density, settings: RunSettings) -> str:
    """Return one sentence about grid and settings."""
    words = (
        f"Grid of Mattas et al. (2022), {density}; lateral profile {settings.profile}"
    )
    behind = "a follower (IDM)" if settings.follower else "nobody"
    return f"{words}; {behind} behind the ego, {_plant_words(settings.plant)}."


def _plant_words(plant: PlantSettings | None) -> str:
    """Return how the ego follows its plans."""
    if plant is None:
        return "which is where its plan says"
    steering, drive = plant.actuators.steering, plant.actuators.drive
    return (
        f"which follows its plans as a {plant.model} vehicle (steering: dead time "
        f"{steering.dead_time:g} s, lag {steering.lag:g} s; drive: {drive.dead_time:g} "
        f"s, {drive.lag:g} s) with the controller {plant.controller.kind}; planners "
        "keep clear its body and its measured errors"
    )


def _markdown(facts: Mapping[str, Any]) -> str:
    """Return the document."""
    parts = [
        "# Cut-in, cut-out, braking leader: who prevents the collision\n",
        "The picture of UN Regulation 157: for every conflict of a grid, who would "
        "have collided. In grey cells the competent and careful human collides, lines "
        "are the borders of what the other drivers cannot prevent, dots are the "
        "planner. Generated by `rearview r157`.\n",
        f"{facts['conditions']}\n",
    ]
    for section in facts["sections"]:
        parts.append(f"## {section['title']}\n")
        if section["headline"]:
            parts.append(_table(section["headline"]))
        parts.extend(
            f"![{picture['title']}](pictures/{picture['file']})\n"
            for picture in section["pictures"]
        )
        parts.append("Cells with a collision:\n")
        parts.append(
            _table(
                [dict(zip(section["header"], r, strict=True)) for r in section["rows"]]
            )
        )
        if section["kind"] == ConflictKind.CUT_IN:
            parts.append(
                f"Not critical for the careful human: {section['uncritical']} cells.\n"
            )
        if section["preventable"]:
            more = len(section["preventable"]) - MOST_ROWS
            words = f", the first {MOST_ROWS}; {more} more are in {NUMBERS}"
            parts.append(
                f"Collisions that the careful human prevents{words if more > 0 else ''}"
                ":\n"
            )
            parts.append(_table(section["preventable"][:MOST_ROWS]))
    parts.append("## What to keep in mind\n")
    parts.append("\n".join(f"- {words}" for words in facts["caveats"]) + "\n")
    return "\n".join(parts)


def _table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows with the same keys as a Markdown table."""
    names = list(rows[0])
    lines = ["| " + " | ".join(names) + " |", "|---" * len(names) + "|"]
    lines += ["| " + " | ".join(str(row[n]) for n in names) + " |" for row in rows]
    return "\n".join(lines) + "\n"
