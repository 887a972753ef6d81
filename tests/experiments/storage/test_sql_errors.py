"""Mistakes in SQL, as DuckDB words them and as users read them."""

import duckdb
import pytest

from experiments.storage.sql_errors import sql_mistake

COLUMNS = ("scenario", "seed", "travel_time_s")


@pytest.fixture(scope="module")
def runs():
    with duckdb.connect() as database:
        database.execute("CREATE TABLE runs AS SELECT 'a' scenario, 1 seed, 2.5 time")
        yield database


@pytest.mark.parametrize(
    ("sql", "expected"),
    [
        ("scenaro = 'a'", "there is no column scenaro; did you mean scenario? "),
        ('scenario = "curved"', "there is no column curved; for a text write 'curved'"),
        ("runs.sed = 3", "there is no column sed; did you mean seed? allowed: scen"),
        ("seed = = 3", "is not SQL at '='; for example: scenario = 'curved'"),
        ("(seed = 3", "is not SQL at '3'; for example"),
        ("scenario = 'a", "unterminated string literal"),
        ("seed IN (SELECT a FROM run)", "there is no table run; allowed: runs"),
        ("foo(seed)", "Scalar Function with name foo does not exist!"),
    ],
)
def test_words_of_a_mistake(runs, sql, expected):
    with pytest.raises(duckdb.Error) as mistake:
        runs.execute(f"SELECT * FROM runs WHERE {sql}")
    words = sql_mistake(str(mistake.value), COLUMNS)
    assert words.startswith(expected)
    assert "Error" not in words
    assert "\n" not in words


def test_a_traceback_of_duckdb_is_left_out_and_long_lists_are_cut():
    text = "Invalid Input Error: Required module 'pytz' failed:\nTraceback (most\n  x"
    assert sql_mistake(text, ()) == "Required module 'pytz' failed:"
    assert sql_mistake("", ()) == "is not understood"
    many = [f"column_{k}" for k in range(200)]
    unknown = 'Binder Error: Referenced column "x" not found in FROM clause!'
    assert len(sql_mistake(unknown, many)) < 500
