"""The contract of a user's planner."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.records import TrafficState
from experiments.cosim.road import EgoTask, Road
from experiments.cosim.scene_builder import Outlook, build_scene
from experiments.interrupts import interrupts_between_steps
from experiments.planners.contract_check import (
    CheckedPlanner,
    PlannerContractError,
    checked,
    watched,
)
from experiments.world_setup.bodies_on_road import PlacedBody, obstacles_on_path
from planner.interface import (
    KEPT,
    Alternative,
    BatchPlanner,
    PlanResult,
    PlanStats,
    PlanStatus,
    SpeedGraph,
)
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, Scene
from planner.states import CartesianState, FrenetState, Trajectory
from planner.vehicle import Vehicle
from tests.experiments.road_users import road_users

OK = PlanStatus.OK
PATH = ReferencePath.from_segments([line(100.0)])


def scene(obstacles: Obstacles | None = None) -> Scene:
    """Stand at the start of a road of one's own, whose arrays may be spoilt."""
    road = Road(PATH, constant_bounds(PATH, 5.0), obstacles=obstacles or one_disc())
    return build_scene(
        road,
        EgoTask(Vehicle(), 80.0, 8.0),
        Outlook(0.1),
        TrafficState(0.0, road_users()),
        CartesianState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        FrenetState(*(0.0,) * 8),
        (),
    )


def one_disc() -> Obstacles:
    return obstacles_on_path(PATH, [PlacedBody("disc", 50.0, 1.0, radius=0.5)])


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


class SpeechlessError(BaseException):
    """Its text raises."""

    def __str__(self) -> str:
        raise self


@dataclass
class Doing:
    """Does something in each cycle, then gives back something."""

    action: Callable[[Scene], object]

    def plan(self, scene, memory):
        return self.action(scene)


def raising(error: BaseException) -> Doing:
    def throw(_):
        raise error

    return Doing(throw)


@pytest.mark.parametrize(
    "leaving",
    [SystemExit("bye"), GeneratorExit(), asyncio.CancelledError(), SpeechlessError()],
)
def test_a_planner_cannot_end_the_process(leaving):
    with pytest.raises(PlannerContractError, match=type(leaving).__name__):
        CheckedPlanner(raising(leaving)).plan(scene(), None)


def test_a_keyboard_interrupt_that_is_no_ctrl_c_is_a_failure_of_the_planner():
    with (
        interrupts_between_steps(),
        pytest.raises(PlannerContractError, match="KeyboardInterrupt"),
    ):
        CheckedPlanner(raising(KeyboardInterrupt())).plan(scene(), None)


def write(array: np.ndarray) -> None:
    array.setflags(write=True)
    array += 1.0


@pytest.mark.parametrize(
    ("part", "name"),
    [
        (lambda scene: scene.path.x, "path"),
        (lambda scene: scene.path.table.knots, "path"),
        (lambda scene: scene.road.left, "road"),
        (lambda scene: scene.obstacles.x, "obstacles"),
    ],
)
def test_writing_into_the_road_is_noticed(part, name):
    own = scene()
    fresh = replace(own, path=ReferencePath.from_segments([line(100.0)]))
    planner = CheckedPlanner(Doing(lambda scene: write(part(scene)) or result()))
    with pytest.raises(PlannerContractError, match=rf"changed scene\.{name};"):
        planner.plan(fresh, None)


def test_reading_the_road_is_allowed():
    planner = CheckedPlanner(Doing(lambda scene: result()))
    for memory in (None, 1):
        assert planner.plan(scene(), memory).status is OK


class Odd(PlanResult):
    """A result that is more than one."""

    __slots__ = ()

    def __getattribute__(self, name):
        if name == "stats":
            raise SpeechlessError
        return super().__getattribute__(name)


def hollow() -> PlanResult:
    """Give a trajectory that was never filled."""
    return PlanResult(OK, object.__new__(Trajectory), None)


@pytest.mark.parametrize("given", [Odd(OK, None, None), hollow()])
def test_what_raises_when_it_is_looked_at_is_the_planners_failure(given):
    with pytest.raises(PlannerContractError, match=r"what plan\(\) returned raises"):
        CheckedPlanner(Doing(lambda _: given)).plan(scene(), None)


def test_a_trajectory_of_a_class_of_ones_own_becomes_a_plain_one():
    class Bent(Trajectory):
        def at(self, t):
            raise SystemExit

    times = [0.0, 0.1]
    given = PlanResult(OK, Bent(times, *([0.0, 0.0] for _ in range(8))), None)
    passed = CheckedPlanner(Doing(lambda _: given)).plan(scene(), None)
    assert type(passed.trajectory) is Trajectory
    assert passed.trajectory.at(0.1).speed == 0.0


def test_a_trajectory_without_end_is_refused():
    times = np.arange(200_000) * 0.1
    given = PlanResult(OK, Trajectory(*(times for _ in range(9))), None)
    with pytest.raises(PlannerContractError, match=r"allowed: up to 100000 points"):
        checked(given)


def test_ctrl_c_goes_through():
    class Interrupted:
        def plan(self, scene, memory):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        CheckedPlanner(Interrupted()).plan(scene(), None)


class OfMany:
    """A planner for many egos that does as it is told."""

    def __init__(self, of_many) -> None:
        self._of_many = of_many

    def plan(self, scene, memory):
        raise AssertionError("a batch was offered")

    def plan_many(self, scenes, memories):
        return self._of_many(scenes, memories)


def leave(scenes, memories):
    raise SystemExit(3)


def spoil(scenes, memories):
    scenes[1].road.left.setflags(write=True)
    scenes[1].road.left[0] += 1.0
    return [result() for _ in scenes]


def test_a_planner_for_many_stays_one_and_gets_all_scenes():
    planner = watched(
        OfMany(lambda scenes, memories: [result(reason=m) for m in memories])
    )
    assert isinstance(planner, BatchPlanner)
    plans = planner.plan_many([scene(), scene()], ["a", "b"])
    assert [plan.stats.reason for plan in plans] == ["a", "b"]
    assert not isinstance(watched(object()), BatchPlanner)


@pytest.mark.parametrize(
    ("of_many", "words"),
    [
        (lambda scenes, memories: None, "plan_many() is NoneType None; allowed: 2 res"),
        (lambda scenes, memories: [result()], "plan_many() is list"),
        (lambda scenes, memories: [result(), 1], "plan_many() is int 1"),
        (leave, "plan_many() raised SystemExit: 3"),
        (spoil, "plan_many() changed scene.road"),
    ],
)
def test_what_a_planner_for_many_may_not_do(of_many, words):
    planner = watched(OfMany(of_many))
    scenes = [scene(), scene()]

    def call_twice():  # the second road is watched in the second call
        for _ in range(2):
            planner.plan_many(scenes, [None, None])

    with pytest.raises(PlannerContractError) as error:
        call_twice()
    assert words in str(error.value)
