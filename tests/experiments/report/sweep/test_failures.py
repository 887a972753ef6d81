"""Reasons of failures that differ in numbers and names, in words for people."""

import pytest

from experiments.report.sweep.failures import failure_kinds

KNOWN = {"arrived": False, "label": "cruise", "planner": "cruise", "scenario": "road"}


def kinds_of(*reasons, status="timeout"):
    rows = [
        {**KNOWN, "status": status, "failure": None, "reason": reason}
        | {"run_id": str(number), "seed": number}
        for number, reason in enumerate(reasons)
    ]
    return failure_kinds(rows, [], ["x"] * len(rows))


@pytest.mark.parametrize(
    ("reasons", "words"),
    [
        (
            ["timeout: s = 12 m of 220 m at t = 60.0 s"],
            "s = 12 m of 220 m at t = 60.0 s",
        ),
        (
            [f"timeout: s = {s} m of 220 m at t = 60.0 s" for s in (88, 9, 101.5)],
            "s = 9 to 101.5 m of 220 m at t = 60.0 s",
        ),
        (
            ["touched car.7 at t = 3.5 s", "touched car.12 at t = 1.0 s"],
            "touched car.7 or another at t = 1.0 to 3.5 s",
        ),
        (["a = -4.5 (limit 4)", "a = 2 (limit 4)"], "a = -4.5 to 2 (limit 4)"),
        ([""], ""),
    ],
)
def test_words_of_a_kind(reasons, words):
    (kind,) = kinds_of(*reasons)
    assert kind.words == words
    assert kind.count == len(reasons)
    assert [run.reason for run in kind.runs] == reasons


def test_other_words_are_another_kind():
    found = kinds_of("touched car.7 at t = 3 s", "fell asleep at t = 3 s")
    assert [kind.count for kind in found] == [1, 1]
