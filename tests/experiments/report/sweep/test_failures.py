"""Reasons of failures that differ in numbers and names, in words for people."""

import pytest

from experiments.report.sweep.failures import failure_kinds, failure_lines

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


@pytest.mark.parametrize(
    ("status", "reason", "sentence"),
    [
        (
            "collision",
            "touched car.7 at t = 3.5 s",
            "The ego touched car.7 at t = 3.5 s.",
        ),
        (
            "timeout",
            "s = 12.0 m of 220.0 m at t = 60.0 s, stands since t = 20.0 s",
            "The ego was at s = 12.0 m of 220.0 m when time was up at t = 60.0 s, "
            "stands since t = 20.0 s.",
        ),
        (
            "blocked",
            "stood 20 s at s = 124.6 m, since t = 3.7 s: no speed plan",
            "The ego stood 20 s at s = 124.6 m, since t = 3.7 s: no speed plan.",
        ),
        ("timeout", "", "timeout."),
        (
            "planner_failed",
            "ZeroDivisionError",
            "The planner failed: ZeroDivisionError.",
        ),
        ("crashed", "the process died", "the process died."),
    ],
)
def test_a_sentence_says_what_happened(status, reason, sentence):
    (kind,) = kinds_of(reason, status=status)
    assert kind.sentence == sentence


def test_a_terminal_reads_the_most_frequent_kinds_and_how_to_look_at_one():
    rare = [f"fell {word}" for word in ("asleep", "ill", "over", "down", "off")]
    kinds = kinds_of("touched car.1 at t = 3 s", "touched car.2 at t = 4 s", *rare)
    lines = failure_lines(kinds, "rearview rerun x")
    assert lines[0].startswith("2 timeout (2 cruise): touched car.1 or another")
    assert lines[0].endswith("Look: rearview rerun x 0")
    assert lines[-1] == "1 other failures: see the page"
