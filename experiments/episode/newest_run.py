"""The newest run of a folder, by the times in the manifests."""

from datetime import UTC, datetime
from pathlib import Path

from experiments.errors import ConfigError, ResultsError
from experiments.storage.json_files import read_json
from experiments.storage.run_files import MANIFEST

RUNS = Path("runs")  # where `rearview run` puts run folders
ENDED = "ended_at"  # in the manifest: when the run ended, ISO 8601, UTC


def newest_run(runs: Path = RUNS) -> Path:
    """Find the run that ended last; files written into a run folder later count not.

    Args:
        runs: Folder of run folders.

    Raises:
        ConfigError: If there is none.
    """
    ended = {file.parent: _ended(file) for file in runs.glob(f"*/{MANIFEST}")}
    if not ended:
        raise ConfigError(
            f"{runs}: there is no run yet; allowed: the folder of one, or first "
            "rearview run intersection"
        )
    return max(ended, key=lambda folder: (ended[folder], folder.name))


def _ended(manifest: Path) -> datetime:
    """Return when a run ended, by the manifest or else by the file's time."""
    try:
        about = read_json(manifest)
        return datetime.fromisoformat(about[ENDED]).astimezone(UTC)
    except (ResultsError, ValueError, KeyError, TypeError, OverflowError):
        # an older or a damaged one
        return datetime.fromtimestamp(manifest.stat().st_mtime, UTC)
