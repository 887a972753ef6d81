"""Collect the published figures and write `results.json` and `results.md`."""

import inspect
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from experiments.comparison import calibration, inference, location
from experiments.config.sweep import DEVELOPMENT_SEEDS, PUBLISHED_SEEDS
from experiments.evidence import studies
from experiments.evidence.document import document
from experiments.evidence.headline import headline
from experiments.storage.atomic_folder import write_atomically
from experiments.storage.json_files import read_json
from experiments.storage.provenance import code_hash, text_hash, versions
from experiments.sweep.processes.parallel import Work

Data = dict[str, Any]
NUMBERS_FILE, DOCUMENT_FILE = "results.json", "results.md"
STUDIES: dict[str, Callable[..., Data]] = {
    "statistics": studies.statistics,
    "layouts": studies.obstacle_layouts,
}
# Only a change of these makes a study anew; a study without them, any change of code.
_MADE_BY: dict[str, Sequence[ModuleType]] = {
    "statistics": (calibration, inference, location)
}


def study_data(name: str, work: Work, out: Path, *, quick: bool) -> tuple[Data, bool]:
    """Compute a study, or read it if the same code has computed it before.

    Args:
        name: Of `STUDIES`.
        work: Worker processes.
        out: Folder that keeps finished studies.
        quick: Whether it is computed from little.

    Returns:
        The study, and whether it is new.
    """
    file = out / f"{name}.json"
    sources = "".join(map(inspect.getsource, _MADE_BY.get(name, ())))
    code = text_hash(sources) if sources else code_hash()
    made_by = {"code": code, "quick": quick}
    if file.is_file():
        kept = read_json(file)
        if kept.get("made_by") == made_by:
            return dict(kept["data"]), False
    data = STUDIES[name](work, quick=quick)
    write_atomically(file, _text({"made_by": made_by, "data": data}))
    return data, True


def keep_claim(claim: Data, out: Path) -> None:
    """Keep the numbers of a sweep, for calls that do not ask for it."""
    write_atomically(_claim_file(claim["name"], out), _text(claim))


def kept_claims(names: Sequence[str], out: Path) -> list[Data]:
    """Read the numbers of those sweeps that were run."""
    files = (_claim_file(name, out) for name in names)
    return [dict(read_json(file)) for file in files if file.is_file()]


def write_evidence(
    claims: Sequence[Data], studied: Data, out: Path, *, quick: bool
) -> Path:
    """Write numbers and document; return the document's file."""
    numbers = {
        "quick": quick,
        "versions": versions(),
        "development_seeds": [DEVELOPMENT_SEEDS[0], DEVELOPMENT_SEEDS[-1]],
        "published_seeds": [PUBLISHED_SEEDS[0], PUBLISHED_SEEDS[-1]],
        "headline": headline(claims),
        "claims": list(claims),
        **studied,
    }
    text = _text(numbers)
    write_atomically(out / NUMBERS_FILE, text)
    write_atomically(out / DOCUMENT_FILE, document(json.loads(text)))
    return out / DOCUMENT_FILE


def _claim_file(name: str, out: Path) -> Path:
    """Return the file of a sweep's numbers."""
    return out / f"claim_{name}.json"


def _text(data: Data) -> str:
    """Write data as the files hold them."""
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
