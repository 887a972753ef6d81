import itertools

import pytest

from experiments.errors import ConfigError
from experiments.thesis.dense.layouts import (
    DIFFERENT_SIZES,
    EFFECTIVENESS,
    SAME_SIZE,
    SIZES,
)
from experiments.thesis.published import FILE, published

TABLES = ("4.1", "4.2", "5.1", "5.2", "5.3", "5.4", "5.5", "6.1")


def decimals(value: float) -> int:
    return len(f"{value:g}".partition(".")[2])


def rounded_from(value: float) -> tuple[float, float]:
    """All that may have been rounded to a printed number."""
    half = 0.5 * 10.0 ** -decimals(value)
    return value - half, value + half


def possible_declines(before: float, after: float) -> tuple[float, float]:
    ends = itertools.product(rounded_from(before), rounded_from(after))
    declines = [100.0 * (b - a) / b for b, a in ends]
    return min(declines), max(declines)


def test_every_table_of_the_three_chapters_is_there():
    tables = published().tables
    assert tuple(tables) == TABLES
    assert tables["4.2"].value("curved proposed", "J_jerk") == 0.6
    assert tables["6.1"].value("DP&QP", "time ms") == 107.4


def test_a_cell_without_a_number_is_no_number():
    with pytest.raises(KeyError, match="has no number"):
        published().tables["4.2"].value("curved conventional", "J_jerk decline %")


def overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] <= other[1] and other[0] <= one[1]


def declines():
    for table, ours, theirs, column, rate in (
        *(
            (
                "4.2",
                f"{road} proposed",
                f"{road} conventional",
                name,
                f"{name} decline %",
            )
            for road in ("straight", "curved", "intersection", "u_shaped")
            for name in ("J_offset", "J_jerk")
        ),
        *(
            (t, "adaptive", "conventional", column, f"{column.split()[0]} decline %")
            for t in ("5.3", "5.5")
            for column in ("length m", "heading rad", "time ms")
        ),
        ("6.1", "ours", "DP&QP", "time ms", "decline %"),
    ):
        found = published().tables[table]
        row = ours if table in ("4.2", "6.1") else theirs
        yield (
            table,
            found.value(theirs, column),
            found.value(ours, column),
            found.value(row, rate),
        )


@pytest.mark.parametrize(("table", "before", "after", "rate"), list(declines()))
def test_declines_follow_from_their_tables_or_are_marked_as_slips(
    table, before, after, rate
):
    low, high = possible_declines(before, after)
    slips = [s for s in published().slips if f"Table {table}" in s.place]
    wrong = [s for s in slips if s.printed == rate and s.unit == "%"]
    if wrong:
        assert not overlap(rounded_from(rate), (low, high))
        rate = wrong[0].right
    assert overlap(rounded_from(rate), (low, high))


def test_effectiveness_follows_from_the_collision_paths():
    table = published().tables["5.2"]
    for n in range(1, 5):
        hits = table.value(f"{n} conventional", "collision paths")
        share = 100.0 * (1.0 - hits / 1365)
        told = table.value(f"{n} conventional", "effectiveness %")
        assert told == pytest.approx(share, abs=0.006)


def test_the_slip_of_the_effectiveness_is_the_only_contradiction_with_the_text():
    table, text = published().tables["5.2"], published().text
    for n in range(1, 5):
        told, said = table.value(f"{n} adaptive", "effectiveness %"), text
        same = told == said[f"effectiveness_{n}"].value
        slips = [s for s in published().slips if s.right == told]
        assert same or slips[0].printed == said[f"effectiveness_{n}"].value


def test_the_study_of_dense_obstacles_knows_the_same_numbers():
    tables = published().tables
    for number, layout in (("5.3", SAME_SIZE), ("5.5", DIFFERENT_SIZES)):
        for name, row in (("uniform", "conventional"), ("adaptive", "adaptive")):
            own, table = layout.published[name], tables[number]
            assert own.length == table.value(row, "length m")
            assert own.max_heading == table.value(row, "heading rad")
            assert own.run_time == table.value(row, "time ms")
    for name, row in (("uniform", "conventional"), ("adaptive", "adaptive")):
        told = [tables["5.2"].rows[f"{n} {row}"] for n in range(1, 5)]
        assert tuple(told) == EFFECTIVENESS[name]
    assert tuple(tables["5.4"].rows.values()) == SIZES


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("r_car [m]: [1]", "r_car [m]: [1, 2]"), "has 2 numbers; allowed: 1"),
        (("title: Obstacles", "titel: Obstacles"), "title: is missing"),
        (("value: 63.72", "value: much"), "value"),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(tmp_path, change, words):
    text = FILE.read_text(encoding="utf-8")
    assert change[0] in text
    damaged = tmp_path / "published.yaml"
    damaged.write_text(text.replace(*change, 1), encoding="utf-8")
    with pytest.raises(ConfigError, match=words) as refused:
        published(damaged)
    assert str(refused.value).startswith(f"{damaged}:")
