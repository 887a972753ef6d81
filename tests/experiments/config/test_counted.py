import pytest

from experiments.config.counted import counted


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 runs"), (1, "1 run"), (2, "2 runs"), (-1, "-1 runs")]
)
def test_only_one_is_singular(count, words):
    assert counted(count, "run") == words
