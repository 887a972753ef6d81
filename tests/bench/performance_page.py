"""Write the figures of one run of the benchmarks into docs/performance.md.

`python -m tests.bench.performance_page FILE.json` replaces what stands between
`<!-- measured: NAME -->` and `<!-- end -->` by the table of that name. All figures come
from one file, so that none is of another version.
"""

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
PART = re.compile(r"(<!-- measured: ([\w ]+) -->\n).*?(<!-- end -->)", re.DOTALL)
LATTICE = "test_whole_cycle[plan_{}-{}-{}-{}]"

Row = tuple[str, str, str]  # label, benchmark, what its time is divided by or a figure
TIMES: Mapping[str, tuple[Row, ...]] = {
    "cruise": (
        ("231 candidates x 51 points", "test_plan_lazily[closed_loop_231]", ""),
        ("the same, every candidate judged", "test_plan[closed_loop_231]", ""),
        ("default settings", "test_plan_lazily[proposed]", ""),
        ("the same, every candidate judged", "test_plan[proposed]", ""),
        (
            "prediction of 30 vehicles x 51 points",
            "test_predicting_thirty_vehicles",
            "",
        ),
    ),
    "programs": (
        ("speed program", "test_programs_that_have_a_solution[speed]", "programs"),
        ("path program", "test_programs_that_have_a_solution[path]", "programs"),
    ),
    "speed plans": tuple(
        (label, f"test_speed_plans_of_101_knots[{n}-{rule}]", "plans")
        for n in (1, 8)
        for rule, label in (
            ("ours", f"every order, vehicles: {n}"),
            ("dp_11x161", f"DP&QP 11 x 161, vehicles: {n}"),
            ("dp_17x321", f"DP&QP 17 x 321, vehicles: {n}"),
            ("dp_21x641", f"DP&QP 21 x 641, vehicles: {n}"),
        )
    ),
    "lane change": (
        ("keeping the lane", "test_a_whole_cycle[keeping]", ""),
        ("seeking among seven bodies", "test_a_whole_cycle[seeking]", ""),
    ),
    "dense": (
        ("side sequences, with speed", "test_whole_cycle_with_speed[planner0]", ""),
        ("adaptive, with speed", "test_whole_cycle_with_speed[planner1]", ""),
        ("uniform, with speed", "test_whole_cycle_with_speed[planner2]", ""),
        *(
            (
                f"{method}, {checks} edges checked, {cover}, {number} obstacles",
                LATTICE.format(method, checks, cover, number),
                "",
            )
            for method in ("adaptive", "uniform")
            for checks in ("needed", "all")
            for cover, number in (("disc", "four"), ("body", "four"), ("body", "many"))
        ),
    ),
}
RATES = (
    ("projection, path of 300 points", "test_projection_on_a_path_of_300_points"),
    ("loop with 30 vehicles", "test_closed_loop_without_a_simulator"),
)
FLEETS = (
    *(f"test_a_step_with_many_egos[{n}]" for n in (20, 80, 160)),
    "test_a_step_with_200_egos_among_200_others",
    "test_a_step_with_50_egos_that_change_lanes",
)
CHANGING = FLEETS[-1]
STARTS = (
    ("everything is compiled", "test_start_to_the_first_step_cold"),
    ("loaded from the cache", "test_start_to_the_first_step_warm"),
)


def filled(page: str, measured: Mapping[str, Any]) -> str:
    """Return the page with the figures of a file of pytest-benchmark.

    Raises:
        KeyError: Names a benchmark that the file lacks, or a part that there is not.
    """
    found = {each["name"]: each for each in measured["benchmarks"]}
    parts = {name: _times(rows, found) for name, rows in TIMES.items()}
    parts["machine"] = _machine(measured)
    parts["rates"] = _rates(found)
    parts["many egos"] = _fleets(found)
    starts = [(label, f"{_stats(found, name)['median']:.1f}") for label, name in STARTS]
    parts["starts"] = _table("s", starts)
    return PART.sub(lambda part: part[1] + parts[part[2]] + part[3], page)


def _times(rows: tuple[Row, ...], found: Mapping[str, Any]) -> str:
    """Return a table of milliseconds."""
    cells = []
    for label, name, divisor in rows:
        stats, info = _stats(found, name), found[name]["extra_info"]
        share = 1e3 / (info[divisor] if divisor else 1)
        cells.append(
            (label, f"{share * stats['min']:.3f} / {share * stats['median']:.3f}")
        )
    return _table("least / median [ms]", cells)


def _rates(found: Mapping[str, Any]) -> str:
    """Return the table of points and steps a second."""
    (path, points), (loop, steps) = RATES
    _stats(found, points), _stats(found, steps)
    millions = found[points]["extra_info"]["points_per_s"] / 1e6
    per_second = found[steps]["extra_info"]["steps_per_s"]
    rows = [
        (path, f"{millions:.1f} million points"),
        (loop, f"{per_second:,.0f} steps"),
    ]
    return _table("a second", rows)


def _fleets(found: Mapping[str, Any]) -> str:
    """Return the table of the steps of many egos."""
    rows = []
    for name in FLEETS:
        _stats(found, name)
        info = found[name]["extra_info"]
        least, median = info["step_cpu_ms_min"], info["step_cpu_ms_p50"]
        label = f"{info['egos']:.0f} egos among {info['vehicles']:.0f} vehicles"
        if name == CHANGING:
            label += ", planner `lane_change`"
        rows.append((label, f"{least:.1f} / {median:.1f}"))
    return _table("CPU time of a step, least / median [ms]", rows)


def _stats(found: Mapping[str, Any], name: str) -> Mapping[str, float]:
    """Return the statistics of a benchmark."""
    if name not in found:
        raise KeyError(f"the file lacks the benchmark {name}")
    stats: Mapping[str, float] = found[name]["stats"]
    return stats


def _table(unit: str, rows: list[tuple[str, str]]) -> str:
    """Return a table in Markdown."""
    lines = [f"| | {unit} |", "|---|---|"]
    return "\n".join([*lines, *(f"| {a} | {b} |" for a, b in rows)]) + "\n"


def _machine(measured: Mapping[str, Any]) -> str:
    """Say where and of what the figures are."""
    machine, commit = measured["machine_info"], measured["commit_info"]
    changed = " with changes" if commit.get("dirty") else ""
    return (
        f"Measured on {measured['datetime'][:10]} on {machine['cpu']['brand_raw']} "
        f"({machine['cpu']['count']} cores), Python {machine['python_version']}, "
        f"at commit {str(commit['id'])[:7]}{changed}.\n"
    )


def main() -> int:
    """Fill the page from the file that is named."""
    if len(sys.argv) != 2:
        sys.stderr.write("usage: python -m tests.bench.performance_page FILE.json\n")
        return 2
    try:
        measured = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
        page = filled(PAGE.read_text(encoding="utf-8"), measured)
    except (OSError, ValueError, KeyError) as error:
        sys.stderr.write(f"{sys.argv[1]}: {error.args[-1]}\n")
        return 2
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
