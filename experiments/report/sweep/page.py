"""The page of a sweep: `report.html` in its folder."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import yaml

from experiments.comparison.compare import Line, Question, compare, named
from experiments.comparison.results import LABEL, RUN_ID, Row, axis_columns, rows
from experiments.comparison.table import cells, header
from experiments.config.scenario_file import CONFIG_FILE
from experiments.config.sweep import Sweep, flat
from experiments.errors import ResultsError
from experiments.metrics import columns
from experiments.metrics.computation import TO_MS
from experiments.report.html import PAGE_FILE, render, save
from experiments.report.run.page import save_run_page
from experiments.report.sweep.data import sweep_data
from experiments.report.sweep.failures import failure_kinds
from experiments.report.sweep.searched import search_part
from experiments.sweep.folder import (
    RERUNS,
    load_sweep_copy,
    run_folder,
    run_folders,
)
from experiments.sweep.rerun_command import rerun_command
from experiments.trace.files import MANY_EGOS, file_name

STEP_KEY = "simulation.step_s"
_SCRIPTS = ("unpack.js", "theme.js", "plot.js", "plots.js", "sweep.js")


def save_sweep_page(folder: Path, file: Path | None = None) -> Path:
    """Write the page of a sweep.

    Args:
        folder: Of the sweep.
        file: Where the page goes; `report.html` in the folder if None.

    Returns:
        The page's file.

    Raises:
        ResultsError: If the folder is damaged, or the disk refuses.
    """
    target = file or folder / PAGE_FILE
    return save(sweep_page(folder, target.parent), target)


def save_run_pages(folder: Path) -> int:
    """Write the page of every run of a sweep that kept its trace.

    Returns:
        How many.
    """
    traces = (file_name("steps"), MANY_EGOS)
    kept = [
        run
        for run in run_folders(folder)
        if any((run / name).is_file() for name in traces)
    ]
    for run in kept:
        save_run_page(run)
    return len(kept)


def sweep_page(folder: Path, beside: Path) -> str:
    """Render the page of a sweep.

    Args:
        folder: Of the sweep.
        beside: Folder that the page's links start from.

    Raises:
        ResultsError: If the folder is damaged.
    """
    sweep = load_sweep_copy(folder)
    found = rows(folder)
    axes = axis_columns(list(found[0])) if found else []
    places = _places(folder, beside, found)
    data = None
    if found:
        order = [planner.shown for planner in sweep.variants]
        data = sweep_data(
            found,
            axes,
            places,
            _deadlines(folder, found),
            order,
            differing_settings(sweep),
        )
    facts = _words(folder, sweep, found)
    facts["failures"] = failure_kinds(found, axes, places)
    facts["search"] = search_part(folder)
    return render("sweep.html.j2", _SCRIPTS, data, facts)


def differing_settings(sweep: Sweep) -> dict[str, dict[str, Any]]:
    """Return the settings in which planners of one name differ: key -> label -> value.

    Planners that do not have a setting are left out of its values.
    """
    found: dict[str, dict[str, Any]] = {}
    names = dict.fromkeys(planner.name for planner in sweep.variants)
    for name in names:
        same = {p.shown: flat(p.settings) for p in sweep.variants if p.name == name}
        for key in dict.fromkeys(key for own in same.values() for key in own):
            values = {label: own.get(key) for label, own in same.items()}
            if len(set(map(str, values.values()))) > 1:
                found.setdefault(key, {}).update(values)
    return found


def _words(folder: Path, sweep: Sweep, found: Sequence[Row]) -> dict[str, Any]:
    """Collect the values of the template."""
    arrived = sum(1 for row in found if row[columns.ARRIVED])
    labels = {str(row[LABEL] or row[columns.PLANNER]) for row in found}
    named = [sweep.claim.baseline] if sweep.claim else []
    known = [*named, *(planner.shown for planner in sweep.variants)]
    baseline = next((label for label in known if label in labels), None)
    lines = compare(found, Question(baseline, by=())) if baseline is not None else []
    place = _from_here(folder)
    return {
        "name": sweep.name,
        "purpose": sweep.purpose,
        "runs": len(found),
        "planned": sweep.count,
        "arrived": arrived,
        "baseline": baseline,
        "header": header(lines),
        "lines": _comparison(lines),
        "folder": place,
        "compare_command": shlex.join(
            ["rearview", "compare", place, "--baseline", baseline or "PLANNER"]
        ),
        "rerun_command": rerun_command(place, [x.name for x in sweep.planners]),
        "overlay_command": shlex.join(["rearview", "compare-runs", place]),
        "asked": yaml.safe_dump(
            sweep.model_dump(mode="json", exclude_defaults=True), sort_keys=False
        ),
    }


def _from_here(folder: Path) -> str:
    """Format a folder for the command line."""
    absolute = folder.absolute()
    here = Path.cwd()
    inside = absolute.is_relative_to(here) and absolute != here
    return str(absolute.relative_to(here) if inside else absolute)


def _comparison(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    """Format the comparison; each metric is named once, with its unit."""
    order = list(dict.fromkeys(line.metric for line in lines))
    lines = sorted(lines, key=lambda line: order.index(line.metric))
    written = []
    before = None
    for line, texts in zip(lines, cells(lines), strict=True):
        name = "" if line.metric == before else named(line.metric)
        written.append((name, *texts[1:]))
        before = line.metric
    return written


def _places(folder: Path, beside: Path, found: Sequence[Row]) -> list[str]:
    """Return what a click on each run opens: its page if there is one, else its folder.

    Relative to the page, so that the folder can be moved and sent.
    """
    try:
        inside = folder.resolve().relative_to(beside.resolve())
        start = "" if inside == Path() else f"{quote(str(inside))}/"
    except ValueError:
        start = f"{folder.resolve().as_uri()}/"
    return [start + quote(_place(folder, str(row[RUN_ID]))) for row in found]


def _place(folder: Path, run_id: str) -> str:
    """Return the page or folder of one run, relative to the sweep's folder."""
    own = str(run_folder(Path(), run_id))
    for page in (f"{RERUNS}/{run_id}/{PAGE_FILE}", f"{own}/{PAGE_FILE}"):
        if (folder / page).is_file():
            return page
    return f"{own}/"


def _deadlines(folder: Path, found: Sequence[Row]) -> list[float]:
    """Return the step of each run [ms].

    Where no axis varies it, all runs of a scenario have that of the first.
    """
    of_scenario: dict[str, float] = {}
    for row in found:
        scenario = str(row[columns.SCENARIO])
        if STEP_KEY not in row and scenario not in of_scenario:
            own = run_folder(folder, str(row[RUN_ID]))
            of_scenario[scenario] = _step_of(own / CONFIG_FILE)
    return [
        TO_MS * float(row.get(STEP_KEY) or of_scenario[str(row[columns.SCENARIO])])
        for row in found
    ]


def _step_of(config: Path) -> float:
    """Read the step from the configuration of a run [s]."""
    try:
        content = yaml.safe_load(config.read_text(encoding="utf-8"))
        return float(content["simulation"]["step_s"])
    except (OSError, ValueError, LookupError, TypeError, yaml.YAMLError) as error:
        raise ResultsError(f"{config}: cannot be read ({error})") from error
