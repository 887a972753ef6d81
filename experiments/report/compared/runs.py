"""Runs read for a comparison, and what differs between them."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from experiments.config.scenario_file import CONFIG_FILE
from experiments.errors import ConfigError, ResultsError
from experiments.metrics.row import read_row
from experiments.report.run_reader import RunRecord, numbers, read_run
from experiments.storage.run_files import read_manifest
from planner.states import FloatArray

MOST = 8  # runs that can still be told apart
APART = 0.5  # distance between two egos from which on their drives differ [m]


@dataclass(frozen=True, slots=True, eq=False)
class ComparedRun:
    """One of the runs: everything in its folder, and the name it goes by."""

    folder: Path
    label: str
    record: RunRecord
    manifest: Mapping[str, Any]
    metrics: Mapping[str, Any]
    settings: Mapping[str, Any]  # keys of the configuration, dotted


def read_compared(folders: Sequence[Path]) -> tuple[list[ComparedRun], list[str]]:
    """Read the runs of a comparison.

    Returns:
        The runs that can be read, and a sentence about each of the others.

    Raises:
        ConfigError: If there are fewer than 2 folders or more than 8.
        ResultsError: If fewer than two can be read.
    """
    if not 2 <= len(folders) <= MOST:  # noqa: PLR2004
        raise ConfigError(f"{len(folders)} runs to compare; allowed: 2 to {MOST}")
    found: list[ComparedRun] = []
    left_out: list[str] = []
    for folder in folders:
        try:
            found.append(_read(folder))
        except ResultsError as error:
            left_out.append(str(error))
    if len(found) < 2:  # noqa: PLR2004
        raise ResultsError(
            f"fewer than two of {len(folders)} runs can be read: {'; '.join(left_out)}"
        )
    return _with_labels(found), left_out


def remarks(runs: Sequence[ComparedRun], left_out: Sequence[str]) -> list[str]:
    """Say what makes a comparison unfair or incomplete, in whole sentences."""
    found = [f"Left out: {words}" for words in left_out]
    for key, words in (
        ("scenario", "The scenarios differ"),
        ("seed", "The seeds differ, and with them the traffic"),
        ("code_hash", "The runs were made by different versions of rearview"),
        ("network_hash", "The networks differ"),
    ):
        values = [str(run.manifest.get(key)) for run in runs]
        if len(set(values)) > 1:
            shown = "" if key.endswith("hash") else f": {', '.join(values)}"
            found.append(f"{words}{shown}.")
    return found


def differing_settings(
    runs: Sequence[ComparedRun],
) -> list[tuple[str, list[str]]]:
    """List the keys of the configurations whose values differ, with all values."""
    keys = dict.fromkeys(key for run in runs for key in run.settings)
    rows = [(key, [_text(run.settings.get(key)) for run in runs]) for key in keys]
    return [(key, values) for key, values in rows if len(set(values)) > 1]


def distance_to_first(runs: Sequence[ComparedRun]) -> list[FloatArray]:
    """Compute how far each ego is from that of the first run at the same time.

    Returns:
        For each run (n_steps,) [m]; NaN for the first run, and after its end.
    """
    first = runs[0].record
    x, y = (numbers(first.trace.steps[key]) for key in ("x_m", "y_m"))
    found = [np.full(first.time.size, np.nan)]
    for run in runs[1:]:
        time, steps = run.record.time, run.record.trace.steps
        gaps = np.hypot(
            numbers(steps["x_m"]) - np.interp(time, first.time, x),
            numbers(steps["y_m"]) - np.interp(time, first.time, y),
        )
        found.append(np.where(time <= first.time[-1] + 1e-9, gaps, np.nan))
    return found


def _read(folder: Path) -> ComparedRun:
    """Read one run."""
    record = read_run(folder)
    manifest = read_manifest(folder)
    config = folder / CONFIG_FILE
    try:
        content = yaml.safe_load(config.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise ResultsError(f"{config}: cannot be read ({error})") from error
    label = (manifest.get("sweep") or {}).get("label") or manifest["planner"]
    settings = dict(_flat("", content)) if isinstance(content, dict) else {}
    return ComparedRun(folder, str(label), record, manifest, read_row(folder), settings)


def _with_labels(runs: list[ComparedRun]) -> list[ComparedRun]:
    """Give each run a name of its own: planner, what differs, or a number.

    What differs is the scenario, the seed, or the first setting whose values tell the
    runs of one planner apart.
    """
    names = [run.label for run in runs]
    for key in ("scenario", "seed"):
        if len(set(names)) < len(names):
            values = [str(run.manifest.get(key)) for run in runs]
            if len(set(values)) > 1:
                word = "seed " if key == "seed" else ""
                names = [
                    f"{name}, {word}{v}" for name, v in zip(names, values, strict=True)
                ]
    if len(set(names)) < len(names):
        names = _with_settings(runs, names)
    if len(set(names)) < len(names):
        names = [f"{name} ({k + 1})" for k, name in enumerate(names)]
    return [
        ComparedRun(
            run.folder, name, run.record, run.manifest, run.metrics, run.settings
        )
        for run, name in zip(runs, names, strict=True)
    ]


def _with_settings(runs: Sequence[ComparedRun], names: Sequence[str]) -> list[str]:
    """Add to names that are there twice a setting by which their runs differ."""
    found = list(names)
    for name in {name for name in names if names.count(name) > 1}:
        same = [k for k, one in enumerate(names) if one == name]
        for key, values in differing_settings([runs[k] for k in same]):
            if len(set(values)) < len(same):
                continue
            short = re.sub(r"^(ego|simulation)\.|\.(model|preset|name)$", "", key)
            for k, value in zip(same, values, strict=True):
                found[k] = name if value == "-" else f"{name}, {short} {value}"
            break
    return found


def _flat(start: str, section: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return the keys of nested sections, joined by dots."""
    found: list[tuple[str, Any]] = []
    for key, value in section.items():
        if isinstance(value, dict) and value:
            found += _flat(f"{start}{key}.", value)
        else:
            found.append((f"{start}{key}", value))
    return found


def _text(value: Any) -> str:
    """Format a value of a configuration."""
    return "-" if value is None else str(value)
