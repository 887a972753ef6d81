"""Claims and tables of chapter 5 say what made-up results hold."""

import math

import pytest

from experiments.thesis.claims import ClaimVerdict
from experiments.thesis.dense.claims import (
    ALL_PATHS,
    COUNTS,
    comparison_claims,
    effectiveness_claims,
    sampling_claims,
    sensitivity_claims,
    time_claims,
)
from experiments.thesis.dense.methods import METHODS, SIDES, Measured
from experiments.thesis.dense.study import RandomLayout, Studied
from experiments.thesis.dense.tables import (
    paths_table,
    picked_table,
    sampling_table,
    sides_table,
    time_table,
)


def measured(name, *, length=50.0, time=2.0, collisions=10, edges=100, solved=True):
    status = "ok" if solved else "no_path"
    cost = 5.0 if solved else math.inf
    return Measured(
        name, status, solved, length, 0.3, 0.1, 0.2, cost, edges, collisions, time
    )


def studied(n, seed, *, same=True, uniform=None, adaptive=None, **changes):
    methods = {name: measured(name) for name in METHODS}
    methods["uniform"] = uniform or measured("uniform", length=52.0, collisions=40)
    methods["adaptive"] = adaptive or methods["adaptive"]
    values = {
        "waypoints": {"uniform": 45, "adaptive": 45 + (n - 2) * 4},
        "occupied": 0,
        "clearance": 0.2,
        "changed": {"uniform": seed > 0, "adaptive": None if seed > 2 else False},
    }
    return Studied(RandomLayout(n, seed, same), methods, **{**values, **changes})


GROUPS = {
    (n, same): [studied(n, seed, same=same) for seed in range(4)]
    for n in COUNTS
    for same in (True, False)
}
PICKED = {
    number: {
        "uniform": measured("uniform", length=55.0, time=2.0),
        "adaptive": measured("adaptive", length=50.0, time=3.0),
        SIDES: measured(SIDES, length=49.0),
    }
    for number in ("5.3", "5.5")
}


def by_id(claims):
    return {claim.id: claim for claim in claims}


def test_more_waypoints_change_the_way_of_the_uniform_sampling():
    found = by_id(sensitivity_claims(GROUPS))
    uniform, adaptive = (found[f"5.1_sensitivity_{n}"] for n in ("uniform", "adaptive"))
    # 3 of 4 layouts in each of six groups with more than one obstacle
    assert (uniform.share.holds, uniform.share.of) == (18, 24)
    assert (adaptive.share.holds, adaptive.share.of) == (18, 18)  # one has no path
    assert adaptive.verdict is ClaimVerdict.HOLDS


def test_counts_of_waypoints_and_paths():
    groups = dict(GROUPS)
    many = measured("uniform", edges=ALL_PATHS)
    groups[1, True] = [studied(1, 0, uniform=many, occupied=2)]
    found = by_id(sampling_claims(groups))
    assert found["5.5_occupied"].measured["of these where the discs touch"] == 2
    assert found["5.5_occupied"].share.holds == 28
    assert found["5.2_paths"].measured == {"paths": ALL_PATHS}
    assert found["5.2_paths"].share.holds == 1
    more = found["5.7.1_more_waypoints_with"]
    assert more.measured == {"adaptive": 53, "conventional": 45}
    assert more.verdict is ClaimVerdict.HOLDS
    fewer = found["5.7.1_fewer_waypoints_below"]  # as many are not fewer
    assert (fewer.share.holds, fewer.share.of) == (0, 4)


def test_effectiveness_is_the_share_of_free_paths():
    groups = dict(GROUPS)
    for n in COUNTS:  # the conventional method falls by 10 % with every obstacle
        worse = measured("uniform", collisions=10 * n)
        groups[n, True] = [studied(n, 0, uniform=worse)]
    found = by_id(effectiveness_claims(groups))
    assert found["5.2_3_higher"].measured["adaptive"] == 90
    assert found["5.2_3_higher"].measured["conventional"] == 70
    assert found["5.2_3_higher"].verdict is ClaimVerdict.HOLDS
    assert found["5.2_1_higher"].share.holds == 0  # 90 % against 90 %
    declines = found["5.2_conventional_declines"]
    assert list(declines.measured.values()) == [90, 80, 70, 60]
    assert declines.picked
    flat = by_id(effectiveness_claims(GROUPS))["5.2_conventional_declines"]
    assert flat.verdict is ClaimVerdict.FAILS
    assert flat.reason == "too few layouts to tell"


def test_lengths_and_times_are_compared_on_the_picked_layouts():
    groups = dict(GROUPS)
    unsolved = studied(4, 9, uniform=measured("uniform", solved=False))
    groups[4, True] = [*GROUPS[4, True], unsolved]
    found = by_id(comparison_claims(PICKED, groups))
    length = found["5.3_length"]
    assert length.picked
    assert length.measured["decline percent"] == pytest.approx(100 * 5 / 55, rel=1e-3)
    assert (length.share.holds, length.share.of) == (4, 4)  # both have to solve it
    heading = found["5.5_max_heading"]
    assert not heading.picked  # the same is not lower
    assert {claim.picked for claim in time_claims(PICKED)} == {True}
    assert time_claims(PICKED)[0].measured["rise percent"] == 50


def test_tables_have_a_row_for_each_group_and_method():
    picked = picked_table("5.3", PICKED["5.3"])
    assert picked.rows[0][:2] == ("uniform", 55)
    sampling = sampling_table(GROUPS)
    assert len(sampling.rows) == 2 * len(GROUPS)
    assert sampling.rows[0] == (1, "one size", "uniform", 45, 100, 40, 60, 60)
    paths = paths_table(GROUPS)
    assert {row[3:5] for row in paths.rows} == {(4, 4)}
    times = time_table(PICKED, GROUPS)
    assert ("picked, Table 5.5", "adaptive", 3) in times.rows
    for table in (picked, sampling, paths, times):
        assert {len(row) for row in table.rows} == {len(table.header)}


def test_paths_that_touch_and_layouts_that_one_method_solves_are_counted():
    lattice_alone = studied(2, 0, clearance=math.nan)
    lattice_alone.methods[SIDES] = measured(SIDES, solved=False)
    groups = {(2, True): [lattice_alone, studied(2, 1, clearance=-0.002)]}
    table = sides_table(groups)
    row = dict(zip(table.header, table.rows[0], strict=True))
    assert row["solved, sides"] == 1
    assert row["solved by a lattice only"] == 1
    assert row["least clearance of sides m"] == -0.002
    assert "negative in 1 of 1 paths, by 2 mm" in table.note
    assert "nowhere negative in 32 paths" in sides_table(GROUPS).note
    nothing = studied(2, 0, adaptive=measured("adaptive", solved=False))
    assert paths_table({(2, True): [nothing]}).rows[0][5] == "-"
