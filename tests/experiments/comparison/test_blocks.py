import itertools

from hypothesis import given
from hypothesis import strategies as st

from experiments.comparison.blocks import blocks, says, whole_width

NAMES = ("metric", "where", "planner", "runs", "value", "p", "note")
TEXT = st.text("abc", max_size=12)
ROWS = st.lists(st.tuples(*(TEXT for _ in NAMES)), max_size=4)


def width_of(block, rows):
    names = [NAMES[k] for k in block]
    return whole_width(names, [[row[k] for k in block] for row in rows])


@given(ROWS, st.integers(20, 200))
def test_each_column_is_once_in_blocks_that_tell_their_rows(rows, width):
    found = blocks(NAMES, rows, width)
    assert all(block[:3] == [0, 1, 2] for block in found)
    assert [k for block in found for k in block[3:]] == [3, 4, 5, 6]
    for block in found:
        assert len(block) == 4 or width_of(block, rows) <= width
    for block, after in itertools.pairwise(found):
        assert width_of([*block, after[3]], rows) > width


@given(ROWS)
def test_a_table_that_fits_is_one_block(rows):
    whole = whole_width(NAMES, rows)
    assert len(blocks(NAMES, rows, whole)) == 1
    assert len(blocks(NAMES, rows, whole - 1)) > 1


def test_a_table_of_keys_alone_is_one_block():
    assert blocks(("metric", "planner"), [("a", "b")], 10) == [[0, 1]]


def test_a_row_is_left_out_where_only_its_keys_are_filled():
    row = ("m", "w", "p", "", "", "", "a note")
    assert says(row, [0, 1, 2, 6], NAMES)
    assert not says(row, [0, 1, 2, 3, 4], NAMES)
