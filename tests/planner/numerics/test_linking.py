"""References to arrays are counted where one is kept, and nowhere else."""

from typing import NamedTuple

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from planner.numerics.compiled import compiled
from planner.numerics.linking import _without_counts_of_arguments

N = 1000


class Pair(NamedTuple):
    one: np.ndarray
    other: np.ndarray


@compiled
def read(pair):
    if pair.one.size == 0:
        return 0.0
    one = pair.one
    return one[0] + pair.other[-1]


@compiled
def swapped(pair):
    return Pair(pair.other, pair.one)


@compiled
def either(pair, first):
    chosen = pair.one
    if not first:
        chosen = pair.other
    return chosen[1:]


@compiled
def through_a_list(pair):
    kept = [pair.one, pair.other]
    kept.append(pair.one)
    kept.pop(0)
    return kept[0]


@compiled
def all_of_them(n):
    pair = Pair(np.full(n, 1.0), np.full(n, 2.0))
    total = 0.0
    for i in range(5):
        turned = swapped(pair)
        total += read(pair) + 10.0 * turned.one[0]
        total += (
            100.0 * either(pair, i % 2 == 0)[0] + 1000.0 * through_a_list(turned)[0]
        )
        pair = turned
    return total, pair


@pytest.fixture(autouse=True)
def _allocations_are_counted():
    _nrt_python.memsys_enable_stats()
    yield
    _nrt_python.memsys_disable_stats()


def test_what_is_returned_or_kept_lives_and_the_rest_is_freed():
    expected, pair = all_of_them.py_func(N)
    all_of_them(N)
    before = rtsys.get_allocation_stats()
    for _ in range(20):
        found, last = all_of_them(N)
        fillers = [np.full(N, 7.0) for _ in range(4)]  # would overwrite what was freed
        assert found == expected
        np.testing.assert_array_equal(last.one, pair.one)
        np.testing.assert_array_equal(last.other, pair.other)
        del last, fillers
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc > 0
    assert after.alloc - before.alloc == after.free - before.free


def test_arrays_of_python_keep_their_count():
    one, other = np.arange(4.0), np.arange(5.0)
    before = rtsys.get_allocation_stats()
    for _ in range(10):
        assert read(Pair(one, other)) == 4.0
        assert swapped(Pair(one, other)).one is not None
        assert either(Pair(one, other), 1)[0] == 1.0
        assert through_a_list(Pair(one, other))[1] == 1.0
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free


FUNCTION = """
define i32 @f(ptr %retptr, ptr %excinfo, ptr %arg.x.0, ptr %"arg.y$1.0") {
entry:
  tail call void @NRT_incref(ptr %arg.x.0)
  call void @NRT_incref(ptr %"arg.y$1.0")
  %r = call i32 @g(ptr %arg.x.0, ptr %"arg.y$1.0")
  LINE
  tail call void @NRT_decref(ptr %arg.x.0)
  call void @NRT_decref(ptr %"arg.y$1.0")
  ret i32 %r
}
"""


@pytest.mark.parametrize(
    "line",
    [
        "store ptr %arg.x.0, ptr %retptr",
        "%p = phi ptr [ %arg.x.0, %a ], [ null, %b ]",
        "%q = select i1 %c, ptr %arg.x.0, ptr null",
        "%v = insertvalue {ptr} undef, ptr %arg.x.0, 0",
        "call void %unknown(ptr %arg.x.0)",
        "call void @NRT_incref(ptr nonnull %arg.x.0)",
    ],
)
def test_an_argument_that_may_escape_keeps_its_counts(line):
    found = _without_counts_of_arguments(FUNCTION.replace("LINE", line))
    assert found.count("ref(ptr %arg.x.0)") == 2
    assert line in found
    assert 'ref(ptr %"arg.y$1.0")' not in found


def test_only_counts_are_deleted():
    text = FUNCTION.replace("LINE", "call void @NRT_decref(ptr %local)")
    kept = [each for each in text.splitlines() if "ref(ptr %" not in each]
    found = _without_counts_of_arguments(text + text).splitlines()
    assert [each for each in found if "%local" not in each] == kept + kept
    assert sum("%local" in each for each in found) == 2
