"""The page of one run: `report.html` in its folder."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.config.scenario_file import CONFIG_FILE
from experiments.errors import ResultsError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.metrics.row import read_row
from experiments.report.html import PAGE_FILE, render, save
from experiments.report.run.candidates import candidates_of
from experiments.report.run.replay import replay
from experiments.report.run_reader import metric_times
from experiments.storage import run_files
from experiments.storage.atomic_folder import require_there
from experiments.trace.files import file_name, read_trace
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
_HASHES = ("run_hash", "config_hash", "network_hash", "code_hash", "trace_hash")


@dataclass(frozen=True, slots=True)
class RunFiles:
    """Manifest, metrics and configuration of a run."""

    manifest: Mapping[str, Any]
    metrics: Mapping[str, Any]
    config: str


def is_run(folder: Path) -> bool:
    """Check whether a folder is a run folder."""
    return (folder / run_files.MANIFEST).is_file()


def save_run_page(folder: Path, file: Path | None = None) -> Path:
    """Write the page of a run.

    Args:
        folder: A run folder.
        file: Where the page goes; `report.html` in the folder if None.

    Returns:
        The page's file.

    Raises:
        ResultsError: If it is not a run folder, is damaged, or the page cannot be
            written.
    """
    return save(run_page(folder), file or folder / PAGE_FILE)


def run_page(folder: Path) -> str:
    """Render the page of a run.

    A run without a trace, or without a single step, gets a page that says so.

    Raises:
        ResultsError: If it is not a run folder or is damaged.
    """
    facts = _facts(folder)
    trace, missing = _trace(folder, facts)
    data = None
    found: dict[str, float] = {}
    if trace is not None:
        found = metric_times(trace, facts.manifest)
        road_map = read_map(folder)
        graphs = read_graphs(folder)
        data = replay(trace, road_map, candidates_of(folder), graphs)
    return render("run.html.j2", _SCRIPTS, data, _words(facts, data, missing, found))


def _facts(folder: Path) -> RunFiles:
    """Read manifest, metrics and configuration."""
    require_there(folder)
    if not is_run(folder):
        raise ResultsError(
            f"{folder}: is neither a run folder nor the folder of a sweep; allowed: a "
            "folder written by rearview run or rearview sweep"
        )
    config = folder / CONFIG_FILE
    try:
        text = config.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ResultsError(f"{config}: cannot be read ({error})") from error
    return RunFiles(run_files.read_manifest(folder), read_row(folder), text)


def _trace(folder: Path, facts: RunFiles) -> tuple[Trace | None, str]:
    """Read the trace; if there is none to show, return the reason."""
    if not (folder / file_name("steps")).is_file() and not _kept(facts):
        return None, (
            "The trace of this run was not kept. "
            f"{facts.manifest.get('command') or 'rearview rerun'} repeats it with "
            "its trace."
        )
    trace = read_trace(folder)
    if len(trace.steps["index"]) == 0:
        return None, "The run ended before its first step: there is nothing to replay."
    if not (folder / MAP_FILE).is_file():
        raise ResultsError(f"{folder / MAP_FILE}: is missing")
    return trace, ""


def _kept(facts: RunFiles) -> bool:
    """Check whether the trace was to be kept."""
    return facts.manifest.get("trace_kept") is not False


def _words(
    facts: RunFiles,
    data: dict[str, Any] | None,
    missing: str,
    times: Mapping[str, float],
) -> dict[str, Any]:
    """Collect the values of the template; `times` are moments of metrics [s]."""
    about = facts.manifest
    status = str(about.get("status", "unknown"))
    reason = str(about.get("reason") or "")
    git = about.get("git") or {}
    commit = str(git.get("commit") or "")
    changed = ", changed" if commit and git.get("dirty") else ""
    return {
        "scenario": about.get("scenario"),
        "planner": about.get("planner"),
        "seed": about.get("seed"),
        "status": status,
        "reason": reason.removeprefix(status).strip(" :"),
        "arrived": status == "arrived",
        "missing": missing,
        "recorded_traffic": facts.metrics.get(columns.RECORDED_TRAFFIC),
        "command": about.get("command"),
        "metrics": metric_lines(facts.metrics, times),
        "events": [] if data is None else data["events"],
        "config": facts.config,
        "versions": about.get("versions") or {},
        "hashes": {key: about[key] for key in _HASHES if about.get(key)},
        "commit": commit + changed,
        "wall": about.get("wall_s"),
        "curves": [] if data is None else data["curves"],
        "counts_candidates": data is not None and data["counts_candidates"],
        "has_graphs": data is not None and data["graphs"] is not None,
        "has_beliefs": data is not None and data["believed"] is not None,
        "has_candidates": data is not None and data["candidates"] is not None,
    }


def metric_lines(
    row: Mapping[str, Any], times: Mapping[str, float]
) -> list[dict[str, Any]]:
    """Format the metrics that apply, those of the terminal first."""
    known = [METRICS[column] for column in row if column in METRICS]
    return [
        {
            "column": metric.column,
            "label": metric.label,
            "value": metric.text(row[metric.column]),
            "unit": metric.unit,
            "time": times.get(metric.column),
        }
        for metric in sorted(known, key=lambda metric: not metric.in_terminal)
        if not metric.identity and row[metric.column] is not None
    ]
