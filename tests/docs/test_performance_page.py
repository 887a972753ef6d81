"""The figures of the performance page come from one file of benchmarks."""

import json
import time

import pytest

from tests.bench import limits, performance_page
from tests.bench.performance_page import FLEETS, PAGE, RATES, STARTS, TIMES, filled

NAMES = [name for rows in TIMES.values() for _, name, _ in rows]
NAMES += [name for _, name in (*RATES, *STARTS)]
NAMES += FLEETS


def measured(names):
    info = {"programs": 4, "plans": 2, "points_per_s": 9.5e6, "steps_per_s": 1234.4}
    info |= {"egos": 20.0, "vehicles": 163.0}
    info |= {"step_cpu_ms_min": 9.96, "step_cpu_ms_p50": 12.0}
    stats = {"min": 0.001, "median": 0.002}
    return {
        "benchmarks": [
            {"name": name, "stats": stats, "extra_info": info} for name in names
        ],
        "machine_info": {
            "cpu": {"brand_raw": "Some CPU", "count": 2},
            "python_version": "3.11.7",
        },
        "commit_info": {"id": "0123456789", "dirty": False},
        "datetime": "2026-01-02T03:04:05",
    }


def test_every_part_of_the_page_is_filled_and_filled_again():
    page = filled(PAGE.read_text(encoding="utf-8"), measured(NAMES))
    assert page == filled(page, measured(NAMES))
    for part in ("machine", "rates", "starts", "many egos", *TIMES):
        assert f"<!-- measured: {part} -->\n" in page
    assert "Measured on 2026-01-02 on Some CPU (2 cores)" in page
    assert "| keeping the lane | 1.000 / 2.000 |" in page
    assert "| speed program | 0.250 / 0.500 |" in page
    assert "| every order, vehicles: 8 | 0.500 / 1.000 |" in page
    assert "9.5 million points" in page
    assert "1,234 steps" in page
    assert "| 20 egos among 163 vehicles | 10.0 / 12.0 |" in page


@pytest.mark.parametrize("without", NAMES)
def test_a_benchmark_that_is_missing_is_named(without, tmp_path, monkeypatch, capsys):
    file = tmp_path / "some.json"
    file.write_text(json.dumps(measured([n for n in NAMES if n != without])))
    monkeypatch.setattr("sys.argv", ["performance_page", str(file)])
    before = PAGE.read_text(encoding="utf-8")
    assert performance_page.main() == 2
    assert PAGE.read_text(encoding="utf-8") == before
    assert (
        capsys.readouterr().err == f"{file}: the file lacks the benchmark {without}\n"
    )


def test_each_table_of_limits_has_its_place():
    page = PAGE.read_text(encoding="utf-8")
    tables = {name: f"| {name} |\n" for name in limits.TABLES}
    changed = limits.filled(page, tables)
    for name, table in tables.items():
        assert f"<!-- limits: {name} -->\n{table}<!-- end -->" in changed
    assert limits.filled(page, {}) == page


def test_samples_belong_to_the_innermost_part_that_is_named():
    def inner(until):
        while time.process_time() < until:
            pass

    def outer():
        inner(time.process_time() + 0.3)

    here = f"{__name__}:test_samples"
    parts = {"outer": (f"{here}", f"{here}.<locals>.outer"), "other": ("nowhere",)}
    found = limits.sampled(outer, parts)
    assert found.cpu >= 0.3
    assert found.share("outer")[0] > 90.0
    assert found.share("other") == (0.0, 0.0)
    assert found.share("outer")[1] < 10.0  # all of it is Python of ours
