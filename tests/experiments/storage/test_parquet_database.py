import duckdb
import pytest

from experiments.storage import parquet_database


def test_a_database_is_kept_until_an_error_may_have_ended_it(monkeypatch):
    opened = []
    connect = duckdb.connect

    def counted(**options):
        opened.append(options)
        return connect(**options)

    monkeypatch.setattr(duckdb, "connect", counted)
    parquet_database._for_reading.cache_clear()
    for _ in range(3):
        with parquet_database.reading() as database:
            assert database.execute("SELECT 5").fetchall() == [(5,)]
    assert len(opened) == 1
    with pytest.raises(duckdb.Error), parquet_database.reading() as database:
        database.execute("SELECT nothing")
    with parquet_database.reading() as database:
        assert database.execute("SELECT 6").fetchall() == [(6,)]
    assert len(opened) == 2


def test_what_is_lent_to_two_is_not_the_same():
    with parquet_database.writing() as one, parquet_database.writing() as other:
        one.execute("CREATE TEMP TABLE own AS SELECT 1")
        with pytest.raises(duckdb.Error):
            other.execute("SELECT * FROM own")
        assert one.execute("SELECT * FROM own").fetchall() == [(1,)]
