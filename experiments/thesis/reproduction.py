"""Write chapters to `thesis.json`, `thesis.md` and the page."""

import json
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.storage.atomic_folder import write_atomically
from experiments.thesis import wording
from experiments.thesis.chapters import Data
from experiments.thesis.claims import printed
from experiments.thesis.document import document
from experiments.thesis.page import save_thesis_page
from experiments.thesis.published import published

NUMBERS_FILE, DOCUMENT_FILE = "thesis.json", "thesis.md"
APART = ("timing", "timing_claims", "pictures")  # not the same every time, or drawn


def numbers_of(chapters: Sequence[Data], *, quick: bool) -> Data:
    """Collect all numbers; machine-dependent ones only under `timing`.

    Args:
        chapters: Of `chapters`, as plain data.
        quick: Whether they are those of `--quick`.
    """
    slips = [
        {**slip.model_dump(), **printed(printed=slip.printed, right=slip.right)}
        for slip in published().slips
    ]
    return {
        "quick": quick,
        "slips": slips,
        "verdicts": wording.counts(list(chapters)),
        "chapters": [
            {key: value for key, value in chapter.items() if key not in APART}
            for chapter in chapters
        ],
        "timing": {
            "machine": machine(),
            "chapters": [
                {
                    "number": chapter["number"],
                    "claims": chapter["timing_claims"],
                    "tables": chapter["timing"],
                }
                for chapter in chapters
                if chapter["timing"]
            ],
        },
    }


def numbers_text(numbers: Data) -> str:
    """Write the numbers as the file holds them."""
    return json.dumps(numbers, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_reproduction(chapters: Sequence[Data], out: Path, *, quick: bool) -> Path:
    """Write numbers, document and page; gives the page's file."""
    text = numbers_text(numbers_of(chapters, quick=quick))
    write_atomically(out / NUMBERS_FILE, text)
    written = json.loads(text)
    write_atomically(out / DOCUMENT_FILE, document(written))
    pictures = {chapter["number"]: chapter["pictures"] for chapter in chapters}
    return save_thesis_page(written, pictures, out)


def machine() -> dict[str, Any]:
    """Describe the machine of the measured times."""
    return {
        "processor": _processor(),
        "system": platform.system(),
        "python": platform.python_version(),
    }


def _processor() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1] for line in lines if line.startswith("model name")]
    return names[0].strip() if names else platform.machine()
