"""The page of one run: `report.html` in its folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.errors import ResultsError
from experiments.report.fleet.page import fleet_page
from experiments.report.html import PAGE_FILE, render, save
from experiments.report.run.candidates import candidates_of
from experiments.report.run.facts import RunFiles, read_facts, run_words
from experiments.report.run.replay import replay
from experiments.report.run_reader import metric_times
from experiments.trace.files import MANY_EGOS, file_name, read_trace
from experiments.trace.road_map import MAP_FILE, read_map
from experiments.trace.schema import Trace
from experiments.trace.speed_graphs import read_graphs

_SCRIPTS = (
    "unpack.js",
    "theme.js",
    "plot.js",
    "scene.js",
    "camera.js",
    "chart.js",
    "graph.js",
    "player.js",
    "events.js",
    "saving.js",
    "pointer.js",
    "controls.js",
    "replay.js",
    "facts.js",
    "run.js",
)


def save_run_page(
    folder: Path, file: Path | None = None, trace: Trace | None = None
) -> Path:
    """Write the page of a run, with one ego or many.

    Args:
        folder: A run folder.
        file: Where the page goes; `report.html` in the folder if None.
        trace: Of the run, if it is at hand; else it is read.

    Returns:
        The page's file.

    Raises:
        ResultsError: If it is not a run folder, is damaged, or the page cannot be
            written.
    """
    many = (folder / MANY_EGOS).is_file()
    page = fleet_page(folder) if many else run_page(folder, trace)
    return save(page, file or folder / PAGE_FILE)


def run_page(folder: Path, at_hand: Trace | None = None) -> str:
    """Render the page of a run.

    A run without a trace, or without a single step, gets a page that says so.

    Args:
        folder: A run folder.
        at_hand: Its trace, if it need not be read.

    Raises:
        ResultsError: If it is not a run folder or is damaged.
    """
    facts = read_facts(folder)
    trace, missing = _trace(folder, facts, at_hand)
    data = None
    found: dict[str, float] = {}
    if trace is not None:
        found = metric_times(trace, facts.manifest)
        road_map = read_map(folder)
        graphs = read_graphs(folder)
        data = replay(trace, road_map, candidates_of(folder), graphs)
    return render("run.html.j2", _SCRIPTS, data, _words(facts, data, missing, found))


def _trace(
    folder: Path, facts: RunFiles, at_hand: Trace | None
) -> tuple[Trace | None, str]:
    """Read the trace; if there is none to show, return the reason."""
    if not (folder / file_name("steps")).is_file() and not facts.trace_kept:
        return None, (
            "The trace of this run was not kept. "
            f"{facts.manifest.get('command') or 'rearview rerun'} repeats it with "
            "its trace."
        )
    trace = read_trace(folder) if at_hand is None else at_hand
    if len(trace.steps["index"]) == 0:
        return None, "The run ended before its first step: there is nothing to replay."
    if not (folder / MAP_FILE).is_file():
        raise ResultsError(f"{folder / MAP_FILE}: is missing")
    return trace, ""


def _words(
    facts: RunFiles,
    data: dict[str, Any] | None,
    missing: str,
    times: Mapping[str, float],
) -> dict[str, Any]:
    """Collect the values of the template; `times` are moments of metrics [s]."""
    return {
        **run_words(facts, missing, times),
        "events": [] if data is None else data["events"],
        "curves": [] if data is None else data["curves"],
        "counts_candidates": data is not None and data["counts_candidates"],
        "has_graphs": data is not None and data["graphs"] is not None,
        "has_beliefs": data is not None and data["believed"] is not None,
        "has_candidates": data is not None and data["candidates"] is not None,
    }
