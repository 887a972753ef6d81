"""The page of several runs: what `rearview compare-runs` writes."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from experiments.metrics.catalogue import METRICS
from experiments.metrics.metric import Better, Metric
from experiments.report.compared.runs import (
    APART,
    ComparedRun,
    differing_settings,
    distance_to_first,
    read_compared,
    remarks,
)
from experiments.report.html import PAGE_FILE, render, save
from experiments.report.run.packing import pack
from experiments.report.run.replay import page_events, replay
from experiments.report.run_reader import metric_times
from planner.states import FloatArray

COMPARISON_FILE = "comparison.html"

_SCRIPTS = (
    "unpack.js",
    "theme.js",
    "plot.js",
    "scene.js",
    "camera.js",
    "chart.js",
    "player.js",
    "events.js",
    "saving.js",
    "pointer.js",
    "controls.js",
    "replay.js",
    "overlay.js",
    "compared.js",
)
_OF_ONE_RUN = ("candidates", "graphs", "counts_candidates", "believed")
_OF_ONE_CYCLE = ("removed", "costs", "candidates", "survivors")


def save_comparison(folders: Sequence[Path], file: Path) -> tuple[Path, list[str]]:
    """Write the page that compares runs.

    Args:
        folders: Of 2 to 8 runs with traces; the first is what others are compared with.
        file: Where the page goes.

    Returns:
        The page's file, and a sentence about each run that was left out.

    Raises:
        ConfigError: If there are too few runs or too many.
        ResultsError: If fewer than two can be read, or the disk refuses.
    """
    runs, left_out = read_compared(folders)
    return save(comparison_page(runs, left_out, file.parent), file), left_out


def comparison_page(
    runs: Sequence[ComparedRun], left_out: Sequence[str], beside: Path
) -> str:
    """Render the page; `beside` is the folder that its links start from."""
    gaps = distance_to_first(runs)
    data = {"runs": [_replayed(run) for run in runs]}
    for own, gap in zip(data["runs"], gaps, strict=True):
        own["curves"].append(_gap_curve(runs[0].label, gap))
    listed = _events(runs, gaps)
    data["events"] = listed
    facts = {
        "runs": [_described(run, beside) for run in runs],
        "remarks": remarks(runs, left_out),
        "events": listed,
        "curves": [
            {"title": curve["title"], "unit": curve["unit"]}
            for curve in data["runs"][0]["curves"]
        ],
        "metrics": _metric_rows(runs),
        "settings": differing_settings(runs),
        "scenario": ", ".join(
            dict.fromkeys(str(run.manifest["scenario"]) for run in runs)
        ),
        "seeds": ", ".join(dict.fromkeys(str(run.manifest["seed"]) for run in runs)),
    }
    return render("compared.html.j2", _SCRIPTS, data, facts)


def _replayed(run: ComparedRun) -> dict[str, Any]:
    """Return what the scripts need of one run; no candidates, costs or counts."""
    found = replay(run.record.trace, run.record.road_map, None)
    cycles = {k: v for k, v in found["cycles"].items() if k not in _OF_ONE_CYCLE}
    kept = {key: value for key, value in found.items() if key not in _OF_ONE_RUN}
    return {
        **kept,
        "cycles": cycles,
        "candidates": None,
        "graphs": None,
        "believed": None,
        "label": run.label,
    }


def _gap_curve(first: str, gap: FloatArray) -> dict[str, Any]:
    """Pack the distance from the first run's ego as a curve."""
    return {
        "title": f"distance to {first}",
        "unit": "m",
        "digits": 2,
        "note": "at the same time",
        "words": "",
        "low": 0.0,
        "high": None,
        "series": [{"name": "distance", "style": "main", "values": pack(gap, 0.01)}],
    }


def _events(
    runs: Sequence[ComparedRun], gaps: Sequence[FloatArray]
) -> list[dict[str, Any]]:
    """Merge the events of all runs, with the moment at which each parts ways."""
    found = []
    for number, (run, gap) in enumerate(zip(runs, gaps, strict=True)):
        own = _replayed_events(run)
        apart = np.flatnonzero(gap > APART)
        if apart.size:
            own.append(
                {
                    "gravity": "note",
                    "time": round(float(run.record.time[apart[0]]), 6),
                    "until": None,
                    "text": f"parts from {runs[0].label} by {APART:g} m",
                }
            )
        found += [{**event, "run": number} for event in own]
    return sorted(found, key=lambda event: (event["time"], event["run"]))


def _replayed_events(run: ComparedRun) -> list[dict[str, Any]]:
    """Return the events of a run with times in the place of steps."""
    time = run.record.time
    return [
        {
            "gravity": event["gravity"],
            "time": event["time"],
            "until": None
            if event["until"] is None
            else round(float(time[event["until"]]), 6),
            "text": event["text"],
        }
        for event in page_events(run.record.trace)
    ]


def _described(run: ComparedRun, beside: Path) -> dict[str, Any]:
    """Describe a run in the table of runs."""
    status = str(run.manifest["status"])
    page = run.folder / PAGE_FILE
    link = os.path.relpath(page.absolute(), beside.absolute())
    return {
        "label": run.label,
        "planner": run.manifest["planner"],
        "scenario": run.manifest["scenario"],
        "seed": run.manifest["seed"],
        "status": status.replace("_", " "),
        "arrived": status == "arrived",
        "reason": str(run.manifest.get("reason") or "")
        .removeprefix(status)
        .strip(" :"),
        "page": quote(link) if page.is_file() else None,
        "folder": str(run.folder),
    }


def _metric_rows(runs: Sequence[ComparedRun]) -> list[dict[str, Any]]:
    """Return one row a metric: the values of all runs, the best marked."""
    times = [metric_times(run.record.trace, run.manifest) for run in runs]
    rows = []
    for column, metric in METRICS.items():
        values = [run.metrics.get(column) for run in runs]
        if metric.identity or all(value is None for value in values):
            continue
        best = _best(metric, values)
        rows.append(
            {
                "column": column,
                "label": metric.label_with_unit,
                "first": metric.in_terminal,
                "cells": [
                    {
                        "text": metric.text(value),
                        "best": number in best,
                        "change": _change(metric, values[0], value) if number else "",
                        "time": None if value is None else times[number].get(column),
                    }
                    for number, value in enumerate(values)
                ],
            }
        )
    return sorted(rows, key=lambda row: not row["first"])


def _best(metric: Metric, values: Sequence[Any]) -> set[int]:
    """Return the numbers of the best runs; none if all are as good."""
    there = [value for value in values if isinstance(value, int | float)]
    if metric.better is Better.NEITHER or len(set(there)) < 2:  # noqa: PLR2004
        return set()
    best = min(there) if metric.better is Better.LOWER else max(there)
    return {number for number, value in enumerate(values) if value == best}


def _change(metric: Metric, first: Any, value: Any) -> str:
    """Format the difference from the first run."""
    both = [v for v in (first, value) if isinstance(v, int | float)]
    if len(both) < 2 or any(isinstance(v, bool) for v in both) or first == value:  # noqa: PLR2004
        return ""
    change = f"{value - first:+.{metric.digits}f}"
    return change if float(change) else ""
