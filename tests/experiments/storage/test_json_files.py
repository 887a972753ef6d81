"""JSON of strangers: what is read can be counted with, printed and written again."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.errors import ResultsError
from experiments.storage.json_files import MAX_DEPTH, parse_json, read_json

PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63) + 1, 2**63 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"])),
    lambda inner: st.lists(inner) | st.dictionaries(st.text("ab.[", max_size=3), inner),
)


@given(PLAIN)
def test_plain_data_reads_back(content):
    assert parse_json(json.dumps(content)) == content
    assert parse_json(json.dumps(content, ensure_ascii=False)) == content


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("NaN", "NaN is not a finite number"),
        ("[-Infinity]", "-Infinity is not a finite number"),
        ("1e999", "1e999 is not a finite number"),
        (str(2**63), "9223372036854775808 is too large a number"),
        ("9" * 5000, "Exceeds the limit"),
        ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), "nested more than 50 levels"),
        ("[" * 100_000, "nested more than 50 levels"),
        ('{"a":' * 100_000, "nested more than 50 levels"),
        ('["\\ud800"]', "surrogate"),
        ('{"a": 1,}', "Expecting property name"),
        ("", "Expecting value"),
    ],
)
def test_odd_texts_are_one_line_about_the_file(tmp_path, text, problem):
    with pytest.raises(ValueError, match=problem):
        parse_json(text)
    file = tmp_path / "x.json"
    file.write_text(text)
    with pytest.raises(ResultsError) as refusal:
        read_json(file)
    assert str(refusal.value).startswith(f"{file}: cannot be read: ")
    assert len(str(refusal.value)) < len(str(file)) + 120


def test_depth_up_to_the_limit_and_pairs_of_surrogates_are_fine():
    deep = "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert parse_json(deep) == json.loads(deep)
    assert parse_json('"\\ud83d\\ude97"') == "🚗"
    assert math.isnan(parse_json("NaN", finite=False))


def test_bytes_that_are_not_utf8(tmp_path):
    file = tmp_path / "x.json"
    file.write_bytes(b'{"a": "\xff"}')
    with pytest.raises(ResultsError, match=r"x\.json: cannot be read: is not UTF-8"):
        read_json(file)
