"""What the pages of runs with one ego and with many say about a run."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.config.scenario_file import CONFIG_FILE
from experiments.errors import ResultsError
from experiments.metrics import columns
from experiments.metrics.catalogue import METRICS
from experiments.metrics.row import read_row
from experiments.storage import run_files
from experiments.storage.atomic_folder import require_there

_HASHES = ("run_hash", "config_hash", "network_hash", "code_hash", "trace_hash")


@dataclass(frozen=True, slots=True)
class RunFiles:
    """Manifest, metrics and configuration of a run."""

    manifest: Mapping[str, Any]
    metrics: Mapping[str, Any]
    config: str

    @property
    def trace_kept(self) -> bool:
        """Whether the trace was to be kept."""
        return self.manifest.get("trace_kept") is not False


def is_run(folder: Path) -> bool:
    """Check whether a folder is a run folder."""
    return (folder / run_files.MANIFEST).is_file()


def read_facts(folder: Path) -> RunFiles:
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


def run_words(
    facts: RunFiles,
    missing: str,
    times: Mapping[str, float],
) -> dict[str, Any]:
    """Collect what templates say of any run; `times` are moments of metrics [s]."""
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
        "config": facts.config,
        "versions": about.get("versions") or {},
        "hashes": {key: about[key] for key in _HASHES if about.get(key)},
        "commit": commit + changed,
        "wall": about.get("wall_s"),
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
