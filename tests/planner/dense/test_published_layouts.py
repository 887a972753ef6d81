"""The claims of [Thesis] 5.7 on its layouts and on random ones."""

import numpy as np
import pytest

from experiments.thesis.dense.layouts import (
    DIFFERENT_SIZES,
    EFFECTIVENESS,
    SAME_SIZE,
    random_layout,
)
from experiments.thesis.dense.methods import (
    METHODS,
    PRINTED,
    SIDES,
    SIDES_PRINTED,
    lattice_method,
    measure,
    measure_random,
    share_better,
)
from planner.dense.lattice_methods import plan_adaptive
from planner.dense.settings import GateReach, LatticeSettings

# Length [m] and largest heading [rad] that an independent prototype measured.
PROTOTYPE = {
    ("same_size", "uniform"): (65.8, 0.888),
    ("same_size", "adaptive"): (62.32, 0.71),
    ("different_sizes", "uniform"): (66.96, 0.934),
    ("different_sizes", "adaptive"): (62.4, 0.634),
}


@pytest.mark.parametrize("layout", [SAME_SIZE, DIFFERENT_SIZES], ids=lambda x: x.name)
def test_adaptive_is_shorter_with_lower_heading(layout):
    rows = {name: measure(name, METHODS[name], layout.array()) for name in METHODS}
    for name in ("uniform", "adaptive"):
        row = rows[name]
        length, heading = PROTOTYPE[layout.name, name]
        assert row.length == pytest.approx(length, abs=0.1)
        assert row.max_heading == pytest.approx(heading, abs=0.02)
        assert row.length == pytest.approx(layout.published[name].length, abs=1.5)
        assert row.max_curvature <= 0.5
    assert rows["adaptive"].length < rows["uniform"].length
    assert rows["adaptive"].max_heading < rows["uniform"].max_heading
    assert rows["uniform"].edges == 1365
    assert rows["adaptive"].effectiveness > 0.95 > rows["uniform"].effectiveness


@pytest.mark.parametrize("layout", [SAME_SIZE, DIFFERENT_SIZES], ids=lambda x: x.name)
def test_printed_layers_lie_right_before_obstacles_and_cost_heading(layout):
    (name, printed), *_ = PRINTED.items()
    row = measure(name, printed, layout.array())
    corrected = measure("adaptive", METHODS["adaptive"], layout.array())
    assert row.solved
    assert row.length > corrected.length
    assert row.max_heading > corrected.max_heading
    assert row.effectiveness < corrected.effectiveness


def test_only_the_inflated_gate_makes_sampling_effective():
    effectiveness = {}
    for reach in GateReach:
        settings = LatticeSettings(gate_reach=reach, narrow_strips=False)
        rows = measure_random(
            4,
            range(20),
            same_size=True,
            methods={"adaptive": lattice_method(plan_adaptive, settings)},
        )
        values = [row.effectiveness for row in rows["adaptive"]]
        effectiveness[reach] = float(np.mean(values))
    assert effectiveness[GateReach.CENTRE] < effectiveness[GateReach.BODY] < 0.5
    assert effectiveness[GateReach.INFLATED] > 0.8


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_effectiveness_falls_for_uniform_and_hardly_for_adaptive(n):
    rows = measure_random(n, range(40), same_size=True)
    uniform = np.median([row.effectiveness for row in rows["uniform"]])
    adaptive = np.median([row.effectiveness for row in rows["adaptive"]])
    # The thesis' own layouts are easier; the order and the fall are its claim.
    assert uniform < EFFECTIVENESS["uniform"][n - 1][1] / 100.0
    assert uniform == pytest.approx((0.79, 0.62, 0.49, 0.37)[n - 1], abs=0.05)
    assert adaptive > uniform + 0.2
    assert adaptive >= (0.99, 0.97, 0.95, 0.85)[n - 1]


def test_random_layouts_keep_their_rule():
    for n in (1, 4, 8):
        for seed in range(20):
            rows = random_layout(n, seed=seed, same_size=False)
            assert np.all((rows[:, 0] >= 8.0) & (rows[:, 0] <= 52.0))
            assert np.all(np.diff(rows[:, 0]) >= 4.0 - 1e-9)
            assert np.all(np.abs(rows[:, 1]) <= 5.0)
            if n <= 4:
                assert len(set(rows[:, 2])) == n
    again = random_layout(4, seed=7, same_size=True)
    assert np.array_equal(again, random_layout(4, seed=7, same_size=True))


@pytest.mark.slow
@pytest.mark.parametrize("same_size", [True, False], ids=["same", "different"])
def test_claims_hold_in_most_random_layouts(same_size):
    solved, better, both = dict.fromkeys(METHODS, 0), 0, 0
    three, also = 0, 0
    for n in (1, 2, 3, 4):
        rows = measure_random(n, range(400), same_size=same_size)
        for name in METHODS:
            solved[name] += sum(row.solved for row in rows[name])
            assert all(row.max_curvature <= 0.5 for row in rows[name] if row.solved)
        for sides, printed, *lattices in zip(
            rows[SIDES],
            rows[SIDES_PRINTED],
            rows["adaptive"],
            rows["uniform"],
            strict=True,
        ):
            for lattice in lattices:
                if lattice.solved:
                    assert sides.solved
                    assert printed.solved
                    assert printed.thesis_cost <= lattice.thesis_cost * (1.0 + 1e-6)
        columns = ("length", "max_heading", "mean_l2")
        counts = share_better(rows[SIDES], rows["adaptive"], columns)
        three, also = three + counts[0], also + counts[1]
        if n > 1:
            counts = share_better(
                rows["adaptive"], rows["uniform"], ("length", "max_heading")
            )
            better, both = better + counts[0], both + counts[1]
    assert solved[SIDES] >= solved["adaptive"] >= solved["uniform"]
    assert solved[SIDES] >= 0.8 * 1600
    assert better > 0.55 * both
    assert three >= 0.7 * also
