import numpy as np
import pytest

from experiments.config.vehicle_model import ActuatorsConfig, PlantConfig
from experiments.evidence.r157.grids import (
    ConflictKind,
    ConflictPanel,
    Density,
    braking_panel,
    cut_in_panel,
    cut_out_panel,
)
from experiments.evidence.r157.planner_runs import (
    RunSettings,
    drive_cells,
    reference_planner,
)
from experiments.evidence.r157.simulate import ConflictEnd, collided, simulate
from experiments.evidence.r157.unpreventable import judge_panel
from experiments.world_setup.vehicle_model import model_settings
from planner.interface import PlanResult, PlanStatus
from planner.lane_change import proposed as lane_change


def sample(panel, every):
    """Return the panel with only some values of both axes."""
    return ConflictPanel(
        panel.kind,
        panel.ego_kmh,
        panel.other_kmh,
        panel.x[:: every[0]],
        panel.y[:: every[1]],
    )


PANELS = {
    "cut_in": sample(cut_in_panel(60, 20, Density.THINNED), (4, 2)),
    "fast cut_in": sample(cut_in_panel(130, 70, Density.THINNED), (4, 2)),
    "braking": sample(braking_panel(Density.THINNED), (4, 3)),
    "cut_out": sample(cut_out_panel(60, Density.THINNED), (3, 2)),
}


@pytest.mark.parametrize("name", ["careful_human", "regulation_157", "fuzzy_safety"])
@pytest.mark.parametrize(
    "grid",
    [
        "cut_in",
        pytest.param("fast cut_in", marks=pytest.mark.slow),
        "braking",
        pytest.param("cut_out", marks=pytest.mark.slow),
    ],
)
def test_a_driver_as_planner_ends_as_in_the_batch(grid, name):
    panel = PANELS[grid]
    planner = reference_planner(panel, name)
    if planner is None:
        assert panel.kind is not ConflictKind.CUT_IN
        return
    rows = drive_cells(planner, panel, range(panel.cells), RunSettings())
    hit = collided(np.array([row.outcome for row in rows]))
    batch = simulate(planner.driver, panel.conflicts(planner.driver))
    # The batch ends when the human finds a cut-in uncritical, the planner drives on.
    compared = batch.outcome != ConflictEnd.UNCRITICAL
    assert batch.collided.any() or grid == "braking"
    assert (compared & ~batch.collided).any()
    np.testing.assert_array_equal(hit[compared], batch.collided[compared])
    if panel.kind is ConflictKind.BRAKING:
        hardest = np.array([row.hardest_braking for row in rows])
        # where speeds become equal, rounding may end one of the two a step earlier
        np.testing.assert_allclose(hardest, batch.hardest_braking, atol=0.02)
        assert np.sum(np.abs(hardest - batch.hardest_braking) > 1e-6) <= 1


class _Nothing:
    def plan(self, scene, memory):
        return PlanResult(PlanStatus.INVALID_SCENE, None, None)


def test_a_planner_without_trajectory_failed():
    rows = drive_cells(_Nothing(), PANELS["cut_in"], [3], RunSettings())
    assert rows[0].outcome == ConflictEnd.FAILED


def test_follower_brakes_behind_a_braking_ego():
    panel = PANELS["cut_in"]
    planner = reference_planner(panel, "careful_human")
    cell = int(np.flatnonzero(~judge_panel(panel).collided["careful_human"].ravel())[0])
    hard = max(
        range(panel.cells),
        key=lambda k: (
            drive_cells(planner, panel, [k], RunSettings())[0].hardest_braking
        ),
    )
    behind = drive_cells(planner, panel, [cell, hard], RunSettings(follower=True))
    assert behind[1].follower_braking > 2.0
    assert not behind[1].follower_hit
    without = drive_cells(planner, panel, [hard], RunSettings())[0]
    assert without.follower_braking == 0.0


# Cells that the careful human passes through without braking. To brake there ends
# beside the vehicle that cuts in; speed has to be held, and a body's width is all room.
PASSES = [(60, 20, 3, 14), (60, 20, 3, 16), (60, 20, 5, 12), (60, 20, 7, 10)]
PASSES += [(40, 10, 3, 10), (50, 10, 3, 14), (50, 20, 3, 10)]


@pytest.mark.parametrize(("ego", "other", "gap", "lateral"), PASSES)
def test_lane_change_does_not_brake_into_a_vehicle_beside_it(ego, other, gap, lateral):
    x, y = np.array([float(gap)]), 0.1 * np.array([lateral])
    panel = ConflictPanel(ConflictKind.CUT_IN, ego, other, x, y)
    assert not judge_panel(panel).collided["careful_human"].any()
    (row,) = drive_cells(lane_change(), panel, [0], RunSettings())
    assert row.outcome == ConflictEnd.AVOIDED
    assert row.hardest_braking < 1.0


@pytest.mark.parametrize("gap", [53.0, 57.0])
def test_lane_change_goes_on_after_fallbacks_within_a_change(gap):
    panel = ConflictPanel(ConflictKind.CUT_IN, 60, 20, np.array([gap]), np.array([0.6]))
    (row,) = drive_cells(lane_change(), panel, [0], RunSettings())
    assert row.outcome == ConflictEnd.AVOIDED


PLANTS = {
    model: model_settings(
        PlantConfig(model=model), ActuatorsConfig(preset="autoware"), None, 2.58
    )
    for model in ("kinematic", "dynamic")
}


@pytest.mark.parametrize("model", PLANTS)
def test_a_plant_brakes_nearly_as_its_plan(model):
    panel = PANELS["cut_in"]
    planner = reference_planner(panel, "careful_human")
    settings = RunSettings(plant=PLANTS[model])
    perfect = drive_cells(planner, panel, range(panel.cells), RunSettings())
    tracked = drive_cells(planner, panel, range(panel.cells), settings)
    assert drive_cells(planner, panel, range(panel.cells), settings) == tracked
    assert tracked != perfect
    braking = np.array(
        [[row.hardest_braking for row in rows] for rows in (perfect, tracked)]
    )
    hard = braking[0] > 3.0  # lag and dead time let it overshoot
    assert hard.sum() > 10
    planned, driven = braking[:, hard].mean(axis=1)
    assert driven == pytest.approx(planned, rel=0.3)


def test_plans_keep_clear_the_body_and_its_errors():
    bodies = []

    class Looks:
        def plan(self, scene, memory):
            bodies.append(scene.vehicle)
            return PlanResult(PlanStatus.INVALID_SCENE, None, None)

    for plant in (None, PLANTS["dynamic"]):
        drive_cells(Looks(), PANELS["cut_in"], [3], RunSettings(plant=plant))
    exact, grown = bodies
    assert grown.length > exact.length
    assert grown.width > exact.width
    assert grown.limits.max_deceleration <= exact.limits.max_deceleration
