"""Puts the summary of the results into a document, between its two marks.

`python -m experiments.evidence.quote README.md docs/results.json`
"""

import json
import sys
from pathlib import Path

from experiments.errors import ResultsError
from experiments.storage.atomic_folder import write_atomically

BEGIN, END = "<!-- results -->", "<!-- end of results -->"


def quoted(text: str, headline: list[str]) -> str:
    """Return a document with another summary.

    Raises:
        ResultsError: If the marks are not there, once each and in order.
    """
    before, begin, rest = text.partition(f"{BEGIN}\n")
    _, end, after = rest.partition(END)
    if not begin or not end or END in after or BEGIN in after:
        raise ResultsError(f"the document needs {BEGIN} and {END}, once each")
    return before + begin + "\n\n".join(headline) + f"\n{END}" + after


def main(document: str, numbers: str) -> None:
    """Quote the headline of a numbers file in a document."""
    path = Path(document)
    headline = json.loads(Path(numbers).read_text(encoding="utf-8"))["headline"]
    write_atomically(path, quoted(path.read_text(encoding="utf-8"), headline))


if __name__ == "__main__":
    main(*sys.argv[1:])
