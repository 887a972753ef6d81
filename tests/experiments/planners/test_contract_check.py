"""The contract of a user's planner."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from experiments.planners.contract_check import (
    CheckedPlanner,
    PlannerContractError,
    checked,
)
from planner.interface import (
    KEPT,
    Alternative,
    PlanResult,
    PlanStats,
    PlanStatus,
    SpeedGraph,
)

OK = PlanStatus.OK


def result(**stats) -> PlanResult:
    return PlanResult(OK, None, "memory", PlanStats(**stats))


def test_what_keeps_the_contract_passes_unchanged():
    given = result(reason="a", candidates=3, removed={"road": 2}, costs={"jerk": 1.5})
    passed = checked(given)
    assert passed.stats == given.stats
    assert passed.memory == "memory"
    assert passed.trajectory is None


def test_survivors_need_not_be_counted():
    assert checked(result(candidates=3, survivors=None)).stats.survivors is None


def test_numbers_of_numpy_become_plain_ones():
    stats = checked(
        result(
            candidates=np.int64(3),
            survivors=np.int32(1),
            removed={"road": np.int64(2)},
            costs={"jerk": np.float32(0.5), "bumps": 1},
        )
    ).stats
    numbers = (stats.candidates, stats.survivors, *stats.removed.values())
    assert [type(number) for number in numbers] == [int] * 3
    assert [type(cost) for cost in stats.costs.values()] == [float] * 2


def test_alternatives_are_made_plain_when_they_are_asked_for():
    asked = []

    def give():
        asked.append(1)
        return [Alternative(KEPT, [1, 2, 3], 4)]

    passed = checked(PlanResult(OK, None, None, alternatives=give))
    assert asked == []
    (one,) = passed.alternatives()
    assert one.x.tolist() == [1.0, 2.0, 3.0]
    assert one.y.tolist() == [4.0] * 3
    assert one.x.dtype == float


@pytest.mark.parametrize(
    "give",
    [
        lambda: 1 / 0,
        lambda: None,
        lambda: ["no alternative"],
        lambda: [Alternative(KEPT, [1, 2, 3], [1, 2])],
    ],
)
def test_a_mistake_in_the_alternatives_costs_only_the_picture(give, caplog):
    passed = checked(PlanResult(OK, None, None, alternatives=give))
    assert passed.alternatives() == ()
    assert "cannot be drawn" in caplog.text


GRAPH = SpeedGraph([0, 1, 2], [0, 5, 10], ("car",), ["before"], [[1, 2, 3]], [[4] * 3])


def test_every_field_of_a_result_survives():
    given = PlanResult(OK, None, "memory", PlanStats("a"), tuple, lambda: GRAPH)
    passed = checked(given)
    empty = [f.name for f in fields(passed) if getattr(passed, f.name) is None]
    assert empty == ["trajectory"]


def test_an_s_t_graph_is_made_plain_when_it_is_asked_for():
    asked = []

    def give():
        asked.append(1)
        return GRAPH

    passed = checked(PlanResult(OK, None, None, speed_graph=give))
    assert asked == []
    graph = passed.speed_graph()
    assert (graph.ids, graph.sides) == (("car",), ("before",))
    assert graph.distance.tolist() == [0.0, 5.0, 10.0]
    assert graph.lower.shape == graph.upper.shape == (1, 3)
    assert graph.t.dtype == graph.upper.dtype == float


@pytest.mark.parametrize(
    "give",
    [
        lambda: 1 / 0,
        lambda: "no graph",
        lambda: replace(GRAPH, t=[0.0], distance=[0.0]),
        lambda: replace(GRAPH, distance=[0.0]),
        lambda: replace(GRAPH, lower=[1, 2, 3]),
        lambda: replace(GRAPH, sides=()),
    ],
)
def test_a_mistake_in_the_s_t_graph_costs_only_the_picture(give, caplog):
    assert checked(PlanResult(OK, None, None, speed_graph=give)).speed_graph() is None
    assert "cannot be drawn" in caplog.text


def test_the_s_t_graph_must_be_a_function():
    with pytest.raises(PlannerContractError, match="speed_graph is SpeedGraph"):
        checked(PlanResult(OK, None, None, speed_graph=GRAPH))


def test_alternatives_must_be_a_function():
    with pytest.raises(PlannerContractError, match="alternatives is list"):
        checked(PlanResult(OK, None, None, alternatives=[]))


def test_a_status_in_words_becomes_the_status():
    assert checked(PlanResult("full_stop", None, None)).status is PlanStatus.FULL_STOP


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (None, r"plan\(\) is NoneType None; allowed: a PlanResult"),
        ("x" * 200, r"plan\(\) is str 'x+\.\.\.; allowed"),
        (PlanResult("splendid", None, None), "status is str 'splendid'; allowed: ok, "),
        (PlanResult(OK, "left", None), "trajectory is str 'left'; allowed: a Traj"),
        (PlanResult(OK, None, None, "stats"), "stats is str 'stats'"),
        (result(reason=None), "stats.reason is NoneType"),
        (result(explanation=None), "stats.explanation is NoneType"),
        (result(blocker=3), "stats.blocker is int 3; allowed: text or None"),
        (result(candidates="many"), "stats.candidates is str 'many'"),
        (result(survivors=1.5), "stats.survivors is float 1.5; allowed: a whole"),
        (result(removed=None), "stats.removed is NoneType None; allowed: a mapping"),
        (result(removed={1: 1}), "stats.removed is dict"),
        (result(removed={"road": None}), r"stats.removed\['road'\] is NoneType"),
        (result(costs={"jerk": math.nan}), r"stats.costs\['jerk'\] is float nan"),
        (result(costs={"jerk": math.inf}), "allowed: a finite number"),
        (result(costs={"jerk": "1"}), "is str '1'"),
    ],
)
def test_what_breaks_it_is_named(given, message):
    with pytest.raises(PlannerContractError, match=message):
        checked(given)


@pytest.mark.parametrize("leaving", [SystemExit("bye"), GeneratorExit()])
def test_a_planner_cannot_end_the_process(leaving):
    class Leaves:
        def plan(self, scene, memory):
            raise leaving

    with pytest.raises(PlannerContractError, match=type(leaving).__name__):
        CheckedPlanner(Leaves()).plan(None, None)


def test_ctrl_c_goes_through():
    class Interrupted:
        def plan(self, scene, memory):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        CheckedPlanner(Interrupted()).plan(None, None)
