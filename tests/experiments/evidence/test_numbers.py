import pytest

from experiments.evidence import numbers
from experiments.evidence.numbers import keep_claim, kept_claims, study_data


@pytest.fixture
def counted(monkeypatch):
    """A study that counts how often it is computed."""
    calls = []

    def study(work, *, quick):
        calls.append(quick)
        return {"calls": len(calls), "quick": quick}

    monkeypatch.setitem(numbers.STUDIES, "own", study)
    return calls


def compute(folder, *, quick=False):
    return study_data("own", None, folder, quick=quick)


def test_a_finished_study_is_read_again(tmp_path, counted):
    assert compute(tmp_path) == ({"calls": 1, "quick": False}, True)
    assert compute(tmp_path) == ({"calls": 1, "quick": False}, False)
    assert counted == [False]


def test_a_study_of_other_code_or_size_is_computed_anew(tmp_path, counted, monkeypatch):
    compute(tmp_path)
    assert compute(tmp_path, quick=True) == ({"calls": 2, "quick": True}, True)
    monkeypatch.setattr(numbers, "code_hash", lambda: "another")
    assert compute(tmp_path, quick=True) == ({"calls": 3, "quick": True}, True)
    assert compute(tmp_path, quick=True)[1] is False
    assert counted == [False, True, True]


def test_a_study_with_sources_of_its_own_lasts_while_these_are_the_same(
    tmp_path, counted, monkeypatch
):
    monkeypatch.setitem(numbers._MADE_BY, "own", (numbers,))
    compute(tmp_path)
    monkeypatch.setattr(numbers, "code_hash", lambda: "another")
    assert compute(tmp_path)[1] is False


def test_claims_that_were_kept_are_read_in_the_order_asked_for(tmp_path):
    for name in ("a", "b"):
        keep_claim({"name": name, "runs": 3}, tmp_path)
    found = kept_claims(["b", "gone", "a"], tmp_path)
    assert [claim["name"] for claim in found] == ["b", "a"]
