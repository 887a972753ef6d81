from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.fleet.kept_step import SHOWN_AHEAD, plan_ahead
from experiments.cosim.fleet.loop import FleetLoop
from experiments.cosim.fleet.records import (
    EnteredVehicle,
    FleetSnapshot,
    FleetStep,
)
from experiments.cosim.fleet.selection import EgoSelection, GroupShare
from experiments.cosim.fleet.takeover import FleetGroup
from experiments.cosim.fleet.ways import EgoWay, NoWayError
from experiments.cosim.kinematic_world import (
    KinematicWorld,
    ScriptedVehicle,
    constant_bounds,
)
from experiments.cosim.loop import run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.records import EpisodeStatus, StepRecord
from experiments.cosim.road import EgoTask, Road, Start
from experiments.cosim.waiting_lines import LINE_VIEW
from planner.cruise import proposed
from planner.interface import PlanResult, PlanStatus
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, line
from planner.scene import RoadUsers
from planner.states import CartesianState, Trajectory
from planner.vehicle import Vehicle, centre_from_rear_axle
from sumo_nets.route_path import StopLine

CAR = Vehicle()
PATH = ReferencePath.from_segments([line(40.0), arc(40.0, 0.01), line(60.0)])
ROAD = Road(PATH, constant_bounds(PATH, 6.0))
TASK = EgoTask(CAR, 120.0, 10.0, Start(speed=8.0))
CARS = (
    ScriptedVehicle("car.1", 30.0, 0.2, 5.0),
    ScriptedVehicle("car.2", 60.0, 3.0, 3.0),
    ScriptedVehicle("car.3", 110.0, -3.5, -6.0),
)


class OfOne:
    """A kinematic world whose ego is one vehicle among the others."""

    def __init__(self, world: KinematicWorld) -> None:
        self._world = world
        self._ego = CartesianState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.step = world.step
        self.lanes = ("road",)
        self.left: list[str] = []

    def enter(self) -> None:
        self._ego = self._world.enter()

    def observe(self) -> FleetSnapshot:
        traffic = self._world.observe()
        x, y = centre_from_rear_axle(self._ego, CAR)
        own = (
            x,
            y,
            self._ego.heading,
            self._ego.speed,
            0.0,
            0.0,
            CAR.length,
            CAR.width,
        )
        there = not self.left
        table = np.column_stack([traffic.vehicles.table, np.array(own)])
        users = RoadUsers.from_table(
            (*traffic.vehicles.ids, *(("ego",) if there else ())),
            table if there else traffic.vehicles.table,
        )
        n = len(users.ids)
        lane = np.where([name == "ego" for name in users.ids], 0, -1)
        zero = np.zeros(n)
        return FleetSnapshot(traffic.time, users, lane, zero, zero, zero, zero, 0)

    def describe(self, name: str) -> EnteredVehicle:
        size = (CAR.length, CAR.width, 20.0, 3.0)
        return EnteredVehicle(name, "car", ("road",), 0, 0, *size)

    def take_over(self, name: str, body: Vehicle) -> CartesianState:
        assert name == "ego"
        return self._ego

    def hand_back(self, name: str) -> None:
        self.left.append(name)

    def take_out(self, name: str) -> None:
        self.left.append(name)

    def forget(self, name: str) -> None:
        raise AssertionError(name)

    def signals(self, road: Road) -> tuple[()]:
        return ()

    def junction_traffic(self, road: Road) -> None:
        raise AssertionError(road)

    def ghost(self, name: str) -> None:
        return None

    def advance(self, egos: Mapping[str, CartesianState], _waiting) -> None:
        self._ego = self._world.advance(egos.get("ego", self._ego))

    def close(self) -> None:
        self._world.close()


def kinematic() -> KinematicWorld:
    return KinematicWorld(ROAD, TASK, CARS)


def drive(world, planner, *, ends_run: bool = False, way=None, duration: float = 30.0):
    steps: list[FleetStep] = []
    loop = FleetLoop(
        world,
        [FleetGroup(planner, ends_run)],
        EgoSelection([GroupShare(("ego",), count=1)], 0),
        way or (lambda vehicle, group: EgoWay(ROAD, TASK)),
        EpisodeOptions(duration=duration),
        steps.append,
    )
    return loop.run(), steps


def test_one_of_many_drives_bit_by_bit_as_a_single_ego():
    records: list[StepRecord] = []
    options = EpisodeOptions(duration=30.0, full_statistics=False)
    ending = run_loop(
        kinematic(), proposed(), PerfectTracking(), TASK, options, records.append
    )
    assert ending.status is EpisodeStatus.ARRIVED
    world = OfOne(kinematic())
    fleet_ending, steps = drive(world, proposed())
    assert fleet_ending.status is EpisodeStatus.ARRIVED
    assert world.left == ["ego"]
    own = [step.egos[0] for step in steps if step.egos]
    assert len(own) == len(records) > 50
    for one, record in zip(own, records, strict=True):
        assert one.ego == record.ego
        assert one.clearance == record.clearance
        assert one.contacts == record.contacts
        status = "" if record.plan is None else str(record.plan.status)
        assert one.status == status


class Raises:
    def plan(self, scene, memory):
        raise ValueError("no idea")


def test_an_ego_without_a_plan_is_handed_back_and_the_run_goes_on():
    world = OfOne(kinematic())
    ending, steps = drive(world, Raises(), duration=2.0)
    assert ending.status is EpisodeStatus.PLANNER_FAILED
    assert ending.reason == "ego: ValueError: no idea"
    assert world.left == ["ego"]
    assert len(steps) == 21
    assert [len(step.egos) for step in steps] == [1] + [0] * 20
    (leaving,) = [x for step in steps for x in step.leavings]
    assert (leaving.index, leaving.how) == (0, "planner_failed")


def test_an_ego_without_a_plan_ends_the_run_if_that_is_wanted():
    ending, steps = drive(OfOne(kinematic()), Raises(), ends_run=True)
    assert ending.status is EpisodeStatus.PLANNER_FAILED
    assert len(steps) == 1


def test_a_vehicle_without_a_way_is_no_ego():
    def no_way(vehicle, group):
        raise NoWayError("too long for the bend")

    world = OfOne(kinematic())
    ending, steps = drive(world, proposed(), way=no_way, duration=1.0)
    assert ending.status is EpisodeStatus.ARRIVED
    assert "1 kinds of vehicles could not be egos" in ending.reason
    assert all(not step.egos and (step.group == -1).all() for step in steps)
    assert world.left == []


def test_a_road_laid_out_in_parts_is_driven_through():
    parts: list[float] = []

    def way(vehicle, group):
        parts.append(world._ego.x)
        return EgoWay(ROAD, EgoTask(CAR, np.inf, 10.0), 40.0 if len(parts) < 2 else 1e9)

    world = OfOne(kinematic())
    _, steps = drive(world, proposed(), way=way, duration=8.0)
    assert len(parts) == 2
    assert parts[0] == 0.0
    assert 40.0 <= parts[1] < 42.0
    x = np.array([step.egos[0].ego.x for step in steps])
    speed = np.array([step.egos[0].ego.speed for step in steps])
    assert np.abs(np.diff(speed)).max() < 0.5  # nothing jumps where the parts meet
    assert np.diff(x).max() < 1.1
    assert pytest.approx(0.0, abs=1e-9) == x[0]


STRAIGHT = ReferencePath.from_segments([line(400.0)])
WIDE_ROAD = Road(STRAIGHT, constant_bounds(STRAIGHT, 5.0))


class Egos:
    """A straight road on which all vehicles are egos: id -> x, y, speed at first."""

    step = 0.1
    lanes = ("road",)

    def __init__(self, starts: Mapping[str, tuple[float, float, float]]) -> None:
        self.states = {
            name: CartesianState(x, y, 0.0, 0.0, speed, 0.0)
            for name, (x, y, speed) in starts.items()
        }
        self._time = 0.0

    def enter(self) -> None:
        pass

    def observe(self) -> FleetSnapshot:
        names = tuple(sorted(self.states))
        rows = []
        for name in names:
            ego = self.states[name]
            x, y = centre_from_rear_axle(ego, CAR)
            size = (CAR.length, CAR.width)
            rows.append((x, y, ego.heading, ego.speed, ego.acceleration, 0.0, *size))
        users = RoadUsers.from_table(names, np.array(rows).reshape(-1, 8).T)
        zero = np.zeros(len(names))
        lane = np.zeros(len(names), np.int64)
        return FleetSnapshot(self._time, users, lane, zero, zero, zero, zero, 0)

    def describe(self, name: str) -> EnteredVehicle:
        size = (CAR.length, CAR.width, 20.0, 3.0)
        return EnteredVehicle(name, "car", ("road",), 0, 0, *size)

    def take_over(self, name: str, body: Vehicle) -> CartesianState:
        return self.states[name]

    def hand_back(self, name: str) -> None:
        del self.states[name]

    take_out = forget = hand_back

    def signals(self, road: Road) -> tuple[()]:
        return ()

    def ghost(self, name: str) -> None:
        return None

    def advance(self, egos: Mapping[str, CartesianState], _waiting) -> None:
        self.states |= egos
        self._time += self.step


def traces(starts: Mapping[str, tuple[float, float, float]], planner=None):
    """Let all drive for 12 s; id -> rows of x, y, heading, speed."""
    steps: list[FleetStep] = []
    task = EgoTask(CAR, 390.0, 12.0)
    loop = FleetLoop(
        Egos(starts),
        [FleetGroup(planner or proposed())],
        EgoSelection([GroupShare(count=10)], 0),
        lambda vehicle, group: EgoWay(WIDE_ROAD, task),
        EpisodeOptions(duration=12.0),
        steps.append,
    )
    assert loop.run().status is EpisodeStatus.ARRIVED
    return {
        name: np.array(
            [
                (one.ego.x, one.ego.y, one.ego.heading, one.ego.speed)
                for step in steps
                for one in step.egos
                if one.id == name
            ]
        )
        for name in starts
    }


SLOW_AND_FAST = ((60.0, 0.8, 3.0), (20.0, -0.6, 11.0))


def test_two_egos_that_change_roles_change_traces():
    """What an ego is called means nothing, also while one swerves round the other."""
    slow, fast = SLOW_AND_FAST
    first = traces({"a": slow, "b": fast})
    second = traces({"a": fast, "b": slow})
    assert len(first["a"]) > 100
    assert np.abs(first["b"][:, 1] - fast[1]).max() > 0.5  # it does something
    np.testing.assert_array_equal(first["a"], second["b"])
    np.testing.assert_array_equal(first["b"], second["a"])


def test_a_mirrored_road_gives_mirrored_traces():
    right = traces(dict(zip("ab", SLOW_AND_FAST, strict=True)))
    starts = [(x, -y, speed) for x, y, speed in SLOW_AND_FAST]
    left = traces(dict(zip("ab", starts, strict=True)))
    for name in "ab":
        mirrored = left[name] * np.array([1.0, -1.0, -1.0, 1.0])
        np.testing.assert_allclose(mirrored, right[name], atol=1e-6)


def test_what_is_shown_of_a_plan_is_where_it_is_at_those_times():
    t = np.array([0.0, 0.3, 0.7, 1.2, 2.4])  # of no simulation's step
    rows = np.zeros((9, t.size))
    rows[0], rows[1], rows[2] = t, 10.0 * t, -2.0 * t
    plan = PlanResult(PlanStatus.OK, Trajectory.from_rows(rows), None)
    ends = [min(time, 2.4) for time in SHOWN_AHEAD]
    expected = [axis * time for time in ends for axis in (10.0, -2.0)]
    assert plan_ahead(plan) == pytest.approx(expected)
    assert plan_ahead(None) == ()


class Together:
    """Plans for all egos in one call; raises in the call of that number."""

    def __init__(self, fails_in=-1, drops=0) -> None:
        self.own, self.sizes = proposed(), []
        self.fails_in, self.drops = fails_in, drops

    def plan(self, scene, memory):
        raise AssertionError("a batch was offered")

    def plan_many(self, scenes, memories):
        self.sizes.append(len(scenes))
        if len(self.sizes) - 1 == self.fails_in:
            raise ValueError("no idea")
        plans = list(map(self.own.plan, scenes, memories))
        return plans[: len(plans) - self.drops]


def test_egos_planned_in_one_call_drive_as_those_planned_one_by_one():
    starts = dict(zip("ab", SLOW_AND_FAST, strict=True))
    planner = Together()
    together, alone = traces(starts, planner), traces(starts)
    assert set(planner.sizes) == {2}
    for name in "ab":
        np.testing.assert_array_equal(together[name], alone[name])


@pytest.mark.parametrize(
    ("planner", "reason"),
    [
        (Together(fails_in=3), "ValueError: no idea"),
        (Together(drops=1), "plan_many() returned 1 plans for 2 scenes"),
    ],
)
def test_a_call_that_fails_ends_all_egos_of_the_planner(planner, reason):
    starts = dict(zip("ab", SLOW_AND_FAST, strict=True))
    steps: list[FleetStep] = []
    loop = FleetLoop(
        Egos(starts),
        [FleetGroup(planner)],
        EgoSelection([GroupShare(count=2)], 0),
        lambda vehicle, group: EgoWay(WIDE_ROAD, EgoTask(CAR, 390.0, 12.0)),
        EpisodeOptions(duration=2.0),
        steps.append,
    )
    assert loop.run().status is EpisodeStatus.PLANNER_FAILED
    leavings = [x for step in steps for x in step.leavings]
    assert [x.id for x in leavings] == ["a", "b"]
    assert {(x.how, x.reason) for x in leavings} == {("planner_failed", reason)}


class Noting(Egos):
    """Notes where egos are after each step, and whether they are before a line."""

    def __init__(self, starts) -> None:
        super().__init__(starts)
        self.noted: list[tuple[float, bool]] = []

    def advance(self, egos, waiting) -> None:
        super().advance(egos, waiting)
        front = {name: ego.x + CAR.front_reach for name, ego in egos.items()}
        self.noted += [(front[name], name in waiting) for name in egos]


def test_egos_just_before_a_line_of_their_road_are_told_to_the_world():
    line_at = 100.0
    road = replace(WIDE_ROAD, stop_lines=(StopLine("light", 0, line_at),))
    world = Noting({"a": (60.0, 0.0, 3.0), "b": (20.0, 0.0, 8.0)})
    FleetLoop(
        world,
        [FleetGroup(proposed())],
        EgoSelection([GroupShare(count=2)], 0),
        lambda vehicle, group: EgoWay(road, EgoTask(CAR, 390.0, 8.0)),
        EpisodeOptions(duration=12.0),
        lambda step: None,
    ).run()
    near = [
        told for front, told in world.noted if 0.1 < line_at - front < LINE_VIEW - 0.1
    ]
    assert len(near) > 4
    assert all(near)
    away = [
        told
        for front, told in world.noted
        if not -0.1 < line_at - front < LINE_VIEW + 0.1
    ]
    assert len(away) > 100
    assert not any(away)
