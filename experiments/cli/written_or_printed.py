"""Text that goes into a file, or to the terminal where none is given."""

import sys
from pathlib import Path

from experiments.errors import ResultsError


def write_or_print(text: str, file: Path | None) -> None:
    """Write a text.

    Raises:
        ResultsError: If the file cannot be written.
    """
    if file is None:
        sys.stdout.write(text)
        return
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        problem = f"{file}: cannot be written: {error.strerror}"
        raise ResultsError(problem) from error
