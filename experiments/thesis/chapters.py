"""The chapters by name, computed or loaded from an earlier run."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.episode.identity import code_hash, shaping_versions
from experiments.errors import ResultsError
from experiments.storage.atomic_folder import write_atomically
from experiments.storage.provenance import ROOT, text_hash
from experiments.sweep.processes.parallel import Work
from experiments.thesis.claims import Chapter
from experiments.thesis.cruise.chapter import cruise_chapter
from experiments.thesis.dense.chapter import dense_chapter
from experiments.thesis.effort import Effort
from experiments.thesis.lane_change.chapter import lane_change_chapter

Data = dict[str, Any]
CHAPTERS: Mapping[str, Callable[[Effort, Work], Chapter]] = {
    "cruise": cruise_chapter,
    "dense": dense_chapter,
    "lane_change": lane_change_chapter,
}
FOLDER = "chapters"  # of the finished ones
INPUTS = (
    "experiments/scenarios/*.yaml",
    "experiments/thesis/*.yaml",
    "sumo_nets/networks/*/*",
)


def identity(effort: Effort) -> Data:
    """Return the inputs of a chapter: with other inputs it is computed again."""
    return {
        "code": code_hash(),
        "layouts": inputs_hash(ROOT),
        "versions": shaping_versions(),
        "effort": asdict(effort),
    }


def inputs_hash(root: Path) -> str:
    """Hash layouts, published numbers and networks; sha256, hexadecimal."""
    digest = hashlib.sha256()
    for pattern in INPUTS:
        for file in sorted(root.glob(pattern)):
            if file.is_file() and file.suffix in (".yaml", ".xml"):
                digest.update(f"{file.relative_to(root)}\n".encode())
                digest.update(file.read_bytes())
    return digest.hexdigest()


def chapter_data(name: str, effort: Effort, work: Work, out: Path) -> tuple[Data, bool]:
    """Return a chapter as plain data.

    Args:
        name: Of `CHAPTERS`.
        effort: How much is computed.
        work: Who computes.
        out: Folder in which finished chapters are kept.

    Returns:
        (the chapter, whether it was computed now).

    Raises:
        ResultsError: If it cannot be written.
    """
    kept = kept_chapter(name, effort, out)
    if kept is not None:
        return kept, False
    data = as_data(CHAPTERS[name](effort, work))
    loaded: Data = json.loads(json.dumps(data))
    whole = {"identity": identity(effort), "hash": _hash(loaded), "chapter": data}
    file = out / FOLDER / f"{name}.json"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultsError(
            f"{file.parent}: cannot be made: {error.strerror}"
        ) from error
    write_atomically(file, json.dumps(whole, ensure_ascii=False, allow_nan=False))
    return loaded, True


def kept_chapter(name: str, effort: Effort, out: Path) -> Data | None:
    """Return a finished chapter if code, layouts and effort are the same."""
    try:
        whole = json.loads((out / FOLDER / f"{name}.json").read_text(encoding="utf-8"))
        same = whole["identity"] == json.loads(json.dumps(identity(effort)))
        whole_one = whole["hash"] == _hash(whole["chapter"])
        return whole["chapter"] if same and whole_one else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None  # none, or not a whole one: it is computed anew


def _hash(chapter: Data) -> str:
    """Hash a chapter, so that a damaged file is noticed."""
    return text_hash(json.dumps(chapter, sort_keys=True))


def as_data(chapter: Chapter) -> Data:
    """Convert a chapter to plain data with the verdict of every claim."""
    data = asdict(chapter)
    for key, claims in (
        ("claims", chapter.claims),
        ("timing_claims", chapter.timing_claims),
    ):
        for plain, claim in zip(data[key], claims, strict=True):
            plain["verdict"] = str(claim.verdict)
    return data


def kept_chapters(names: Sequence[str], effort: Effort, out: Path) -> list[Data]:
    """Return all finished chapters of these names."""
    found = (kept_chapter(name, effort, out) for name in names)
    return [chapter for chapter in found if chapter is not None]
