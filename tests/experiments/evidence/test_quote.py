"""The summary in a document."""

import json

import pytest

from experiments.errors import ResultsError
from experiments.evidence.quote import BEGIN, END, main, quoted


def test_the_summary_is_replaced_and_nothing_else(tmp_path):
    document, numbers = tmp_path / "a.md", tmp_path / "a.json"
    document.write_text(f"before\n{BEGIN}\nold\n\nolder\n{END}\nafter\n")
    numbers.write_text(json.dumps({"headline": ["one", "two"]}))
    for _ in range(2):
        main(str(document), str(numbers))
        assert document.read_text() == f"before\n{BEGIN}\none\n\ntwo\n{END}\nafter\n"


@pytest.mark.parametrize(
    "text", ["", BEGIN, f"{END}\n{BEGIN}\n", f"{BEGIN}\n{END}{END}"]
)
def test_marks_have_to_be_there(text):
    with pytest.raises(ResultsError, match="once each"):
        quoted(text, ["one"])
