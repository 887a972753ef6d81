"""The page of a run with many egos."""

from pathlib import Path
from typing import Any

import yaml

from experiments.errors import ResultsError
from experiments.report.fleet.replay import fleet_replay, read_tables
from experiments.report.html import render
from experiments.report.run.facts import read_facts, run_words
from experiments.trace.road_map import MAP_FILE, RoadMap, read_map

_SCRIPTS = (
    "unpack.js",
    "theme.js",
    "plot.js",
    "camera.js",
    "player.js",
    "time_space.js",
    "fleet_scene.js",
    "fleet.js",
)


def fleet_page(folder: Path) -> str:
    """Render the page of a run with many egos.

    Raises:
        ResultsError: If it is not such a run folder or is damaged.
    """
    facts = read_facts(folder)
    tables, plans = read_tables(folder)
    there = (folder / MAP_FILE).is_file()  # none in folders of earlier versions
    road_map = read_map(folder) if there else RoadMap()
    missing = "" if len(tables["fleet"]["index"]) else "The run holds no vehicle."
    drivers = _drivers(facts.config, folder)
    data = None if missing else fleet_replay(tables, plans, road_map, drivers)
    words = run_words(facts, missing, {})
    shown = {**words, "drivers": drivers, "ends": [] if data is None else data["ends"]}
    return render("fleet.html.j2", _SCRIPTS, data, shown)


def _drivers(config: str, folder: Path) -> list[str]:
    """Return the planner of each group of egos."""
    try:
        scenario: Any = yaml.safe_load(config)
        groups, own = scenario["egos"], scenario["planner"]["name"]
        groups = [groups] if isinstance(groups, dict) else groups
        return [str((one.get("planner") or {}).get("name", own)) for one in groups]
    except (yaml.YAMLError, KeyError, TypeError, AttributeError) as error:
        raise ResultsError(f"{folder}: its configuration is damaged: {error}") from None
