import asyncio
import hashlib
import json
import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace

import numpy as np
import pytest

from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.kinematic_world import (
    KinematicWorld,
    ScriptedVehicle,
    constant_bounds,
)
from experiments.cosim.loop import run_loop
from experiments.cosim.plant import PerfectTracking
from experiments.cosim.records import (
    EpisodeStatus,
    Signal,
    StepRecord,
    TrafficState,
)
from experiments.cosim.road import EgoTask, Road, Start
from experiments.errors import SimulationError
from experiments.world_setup.bodies_on_road import PlacedBody, obstacles_on_path
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, Scene
from planner.states import Trajectory
from planner.vehicle import Vehicle

CAR = Vehicle()
PATH = ReferencePath.from_segments([line(200.0)])
T = np.arange(11) * 0.1


def along(scene: Scene, speed: float, drift: float = 0.0) -> Trajectory:
    """Follow the path at the ego's offset, from its place on at `speed`."""
    s = scene.ego_frenet.s + speed * T
    l = scene.ego_frenet.l + drift * T
    point = scene.path.at(s)
    zero = np.zeros(T.size)
    return Trajectory(
        T,
        point.x - l * point.sin_heading,
        point.y + l * point.cos_heading,
        point.heading,
        point.curvature,
        zero + math.hypot(speed, drift),
        zero,
        s,
        l,
    )


@dataclass
class Scripted:
    """Drives at a speed that may depend on the scene; counts its cycles."""

    speed: Callable[[Scene], float] | float = 8.0
    drift: float = 0.0
    stats: PlanStats = field(default_factory=PlanStats)

    def __post_init__(self) -> None:
        self.scenes: list[Scene] = []
        self.memories: list[object] = []

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        self.scenes.append(scene)
        self.memories.append(memory)
        speed = self.speed(scene) if callable(self.speed) else self.speed
        trajectory = along(scene, speed, self.drift)
        return PlanResult(PlanStatus.OK, trajectory, len(self.scenes), self.stats)


def world(*vehicles: ScriptedVehicle, l: float = 0.0, obstacles=None, kind=None):
    return (kind or KinematicWorld)(road(obstacles), task(l=l), vehicles)


def road(obstacles=None) -> Road:
    bounds = constant_bounds(PATH, 5.0)
    return Road(PATH, bounds, obstacles=obstacles or Obstacles.none())


def task(goal: float = 60.0, l: float = 0.0) -> EgoTask:
    return EgoTask(CAR, goal, 8.0, Start(l=l))


def run(a_world, planner, *, goal: float = 60.0, **changes):
    records: list[StepRecord] = []
    options = EpisodeOptions(**({"duration": 30.0} | changes))
    ending = run_loop(
        a_world, planner, PerfectTracking(), task(goal), options, records.append
    )
    return ending, records


class AtRed(KinematicWorld):
    """A light at 40 m: green for 1 s, yellow for 1 s, red for 15 s, and again."""

    def observe(self) -> TrafficState:
        now = super().observe()
        phase = math.fmod(now.time, 17.0)
        letter = "G" if phase < 1.0 else "y" if phase < 2.0 else "r"
        return replace(now, signals=(Signal("light", 40.0, letter),))


class Jumps(KinematicWorld):
    """Its vehicles jump back by 90 m after 1 s."""

    def advance(self, ego):
        if self._steps == 10:
            self._s = self._s - 90.0
        return super().advance(ego)


def test_arrives_and_records_every_step():
    ending, records = run(world(), Scripted(), goal=59.9)
    assert ending.status is EpisodeStatus.ARRIVED
    steps = math.ceil(59.9 / 0.8)
    assert [r.index for r in records] == list(range(steps + 1))
    assert [r.time for r in records] == pytest.approx(0.1 * np.arange(steps + 1))
    assert records[-1].plan is None
    assert records[-1].planning is None
    assert all(r.plan is not None and r.planning.wall_ms > 0.0 for r in records[:-1])
    assert [r.ego.x for r in records] == pytest.approx(0.8 * np.arange(steps + 1))
    assert records[-1].ego_frenet.s >= 59.9 > records[-2].ego_frenet.s


def test_memory_and_scene_go_to_the_planner():
    planner = Scripted()
    car = ScriptedVehicle("car", 90.0, 3.0, 4.0)
    bodies = obstacles_on_path(PATH, [PlacedBody("disc", 120.0, -4.0, radius=0.5)])
    run(world(car, obstacles=bodies), planner, horizon=3.0)
    assert planner.memories == [None, *range(1, len(planner.memories))]
    scene = planner.scenes[10]
    assert scene.time == pytest.approx(1.0)
    assert scene.vehicles.ids == ("car",)
    assert scene.vehicles.x == pytest.approx([94.0])
    assert scene.vehicles.prediction.x[0, -1] == pytest.approx(94.0 + 4.0 * 3.0)
    assert scene.obstacles.ids == ("disc",)
    assert (scene.step, scene.target_speed) == (0.1, 8.0)


def test_a_collision_ends_the_episode_and_names_the_body():
    ending, records = run(world(ScriptedVehicle("car", 40.0, 0.0, 0.0)), Scripted())
    assert ending.status is EpisodeStatus.COLLISION
    assert "car" in ending.reason
    assert records[-1].contacts == ("car",)
    assert records[-1].clearance == 0.0
    assert all(r.contacts == () for r in records[:-1])
    gap = 40.0 - 2.4 - CAR.front_reach
    assert records[-2].clearance == pytest.approx(gap - records[-2].ego.x)


def test_a_car_that_jumps_through_the_ego_is_a_collision():
    car = ScriptedVehicle("car", 60.0, 0.0, 0.0)
    ending, records = run(world(car, kind=Jumps), Scripted(speed=0.0))
    assert ending.status is EpisodeStatus.COLLISION
    assert records[-1].clearance > 10.0


def test_a_body_over_the_road_s_edge_costs_the_arrival():
    start = 5.0 - CAR.width / 2.0
    drifting = Scripted(drift=0.05)
    ending, records = run(world(l=start - 0.2), drifting)
    assert ending.status is EpisodeStatus.OFF_ROAD
    over = [r for r in records if r.off_road > 0.01]
    assert len(records) > len(over) > 10
    assert f"in {len(over)} steps" in ending.reason
    inside, _ = run(world(l=start - 0.05), Scripted())
    assert inside.status is EpisodeStatus.ARRIVED


def test_leaving_the_path_s_domain_ends_at_once():
    class Turns:
        """Turns left by 1 rad/s on a circle of 1 m."""

        def plan(self, scene, memory):
            ego, zero = scene.ego, np.zeros(T.size)
            heading = ego.heading + T
            x = ego.x + np.sin(heading) - math.sin(ego.heading)
            y = ego.y - np.cos(heading) + math.cos(ego.heading)
            trajectory = Trajectory(T, x, y, heading, zero + 1, zero + 1, zero, T, y)
            return PlanResult(PlanStatus.OK, trajectory, memory)

    ending, records = run(world(), Turns())
    assert ending.status is EpisodeStatus.OFF_ROAD
    assert records[-1].time == pytest.approx(1.6)  # the first one beyond pi / 2
    assert records[-1].ego_frenet is None
    assert records[-1].plan is None
    assert all(r.ego_frenet is not None for r in records[:-1])


def test_time_runs_out():
    ending, records = run(world(), Scripted(speed=1.0), duration=2.0)
    assert ending.status is EpisodeStatus.TIMEOUT
    assert records[-1].time == pytest.approx(2.0)


def test_a_stuck_ego_is_blocked_with_its_reason():
    bodies = obstacles_on_path(PATH, [PlacedBody("wall", 40.0, 0, 1.0, 9.0)])

    def brake(scene: Scene) -> float:
        return 8.0 if scene.ego_frenet.s < 30.0 else 0.0

    planner = Scripted(brake, stats=PlanStats("no way past wall", blocker="wall"))
    ending, records = run(world(obstacles=bodies), planner, blocked_after=5.0)
    assert ending.status is EpisodeStatus.BLOCKED
    assert "no way past wall" in ending.reason
    stood = [r.time for r in records if r.ego.speed < 0.1]
    assert stood[-1] - stood[0] == pytest.approx(5.0)


def test_waiting_at_a_red_light_is_not_being_blocked():
    def obey(scene: Scene) -> float:
        lines = [s for s in scene.stop_lines if s - scene.ego_frenet.s < 8.0]
        return 0.0 if lines else 8.0

    planner = Scripted(obey, stats=PlanStats("waits"))
    ending, records = run(world(kind=AtRed), planner, blocked_after=5.0)
    assert ending.status is EpisodeStatus.ARRIVED
    assert sum(r.ego.speed < 0.1 for r in records) > 80
    assert {r.stop_lines for r in records} == {(), (40.0,)}


class Raises:
    def plan(self, scene, memory):
        raise ZeroDivisionError("no denominator")


class Returns:
    """Returns something else than a drivable plan from the third cycle on."""

    def __init__(self, make) -> None:
        self.make = make

    def plan(self, scene, memory):
        if scene.time > 0.15:
            return self.make(scene)
        return PlanResult(PlanStatus.OK, along(scene, 8.0), None)


def broken(**columns) -> Callable[[Scene], PlanResult]:
    """Damage a sound trajectory."""

    def make(scene: Scene) -> PlanResult:
        sound = along(scene, 8.0)
        given = {column.name: getattr(sound, column.name) for column in fields(sound)}
        given |= {name: change(given[name]) for name, change in columns.items()}
        return PlanResult(PlanStatus.OK, Trajectory(**given), None)

    return make


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda scene: None, "NoneType"),
        (
            lambda scene: PlanResult(
                PlanStatus.INVALID_SCENE, None, None, PlanStats("bad scene")
            ),
            "bad scene",
        ),
        (broken(x=lambda x: x * math.nan), "not finite"),
        (broken(y=lambda y: y + 0.5), "0.50 m from the ego"),
        (broken(x=lambda x: np.where(T > 0.0, x + 30.0, x)), "jumps"),
    ],
)
def test_what_cannot_be_driven_is_a_failed_planner(make, message):
    ending, records = run(world(), Returns(make))
    assert ending.status is EpisodeStatus.PLANNER_FAILED
    assert message in ending.reason
    assert len(records) == 3
    assert records[-1].plan is None


def test_an_exception_of_the_planner_is_an_ending_and_is_logged(caplog):
    ending, records = run(world(), Raises())
    assert ending.status is EpisodeStatus.PLANNER_FAILED
    assert ending.reason == "ZeroDivisionError: no denominator"
    assert len(records) == 1
    assert caplog.records[0].exc_info is not None


class FailingWorld(KinematicWorld):
    """A simulator that gives up."""

    failing = "observe"

    def enter(self):
        self._fail("enter")
        return super().enter()

    def observe(self):
        if self._steps == 3:
            self._fail("observe")
        return super().observe()

    def advance(self, ego):
        if self._steps == 3:
            self._fail("advance")
        return super().advance(ego)

    def _fail(self, where: str) -> None:
        if where == self.failing:
            raise SimulationError(f"gave up in {where}")


@pytest.mark.parametrize(("where", "n"), [("enter", 0), ("observe", 3), ("advance", 4)])
def test_a_failed_simulator_is_an_ending(where, n):
    failing = FailingWorld(road(), task())
    failing.failing = where
    ending, records = run(failing, Scripted())
    assert ending.status is EpisodeStatus.SIMULATOR_FAILED
    assert ending.reason == f"gave up in {where}"
    assert len(records) == n


def test_bugs_of_our_own_come_out():
    class Buggy(KinematicWorld):
        def observe(self):
            raise KeyError("ours")

    with pytest.raises(KeyError, match="ours"):
        run(world(kind=Buggy), Scripted())


def test_the_loop_does_not_touch_what_it_was_given():
    obstacles = Obstacles.none()
    a_world = world(obstacles=obstacles)
    _, first = run(a_world, Scripted())
    _, second = run(world(obstacles=obstacles), Scripted())
    assert digest(first) == digest(second)


def digest(records: list[StepRecord]) -> str:
    """Hash everything of a run but the wall-clock times."""
    hashed = hashlib.sha256()
    for r in records:
        hashed.update(repr((r.ego, r.ego_frenet, r.stop_lines, r.contacts)).encode())
        hashed.update(repr((r.clearance, r.nearest, r.off_road)).encode())
        hashed.update(json.dumps(r.traffic.vehicles.ids).encode())
        hashed.update(r.traffic.vehicles.table.tobytes())
        hashed.update(repr(r.traffic.ghost).encode())
    return hashed.hexdigest()


@pytest.mark.sumo
def test_a_sumo_episode_is_repeatable_and_its_rear_car_reacts(straight):
    rear = (
        '<vehicle id="rear" type="car" route="own" depart="0" departLane="2" '
        'departPos="50" departSpeed="13"/>'
    )

    class ChangesLanes:
        """Moves one lane to the left in 4 s."""

        def plan(self, scene, memory):
            ego = scene.ego
            y = np.clip(ego.y + 10.0 / 3.0 / 4.0 * T, 0.0, 10.0 / 3.0)
            zero = np.zeros(T.size)
            x = ego.x + ego.speed * T
            trajectory = Trajectory(
                T, x, y, zero, zero, zero + ego.speed, zero, x + 100.0, y
            )
            return PlanResult(PlanStatus.OK, trajectory, None)

    runs = []
    for _ in range(2):
        sumo = straight(rear, start_s=70.0, start_speed=9.0)
        ending, records = run(sumo, ChangesLanes(), goal=250.0)
        sumo.close()
        runs.append((ending, digest(records), sumo.reported_collisions))
    assert runs[0] == runs[1]
    assert runs[0][0].status is EpisodeStatus.ARRIVED
    assert runs[0][2] == 0
    speeds = [float(r.traffic.vehicles.speed[0]) for r in records]
    assert max(speeds) > 12.0
    assert speeds[-1] < 9.5
    assert any(r.traffic.ghost is not None for r in records)
    assert min(r.clearance for r in records) > 1.0


def test_settings_are_values():
    assert replace(task(), goal=60.0) == task()
    assert replace(EpisodeOptions(), duration=90.0) == EpisodeOptions()


@dataclass
class Reversing(Scripted):
    """Creeps back, and lies about its speed and its place along the road."""

    def plan(self, scene, memory):
        plan = super().plan(scene, memory)
        forward = plan.trajectory
        back = replace(forward, x=2.0 * forward.x[0] - forward.x)
        return replace(plan, trajectory=back)


def test_an_ego_that_goes_back_ends_the_episode():
    ending, records = run(world(), Reversing())
    assert ending.status is EpisodeStatus.PLANNER_FAILED
    words = (
        r"drove against the road's direction, from s = 0.0 m back to -1.6 m at t = 0"
    )
    assert re.match(words, ending.reason), ending
    assert len(records) == 3


class MuteError(BaseException):
    def __str__(self):
        raise self


@pytest.mark.parametrize(
    "error", [asyncio.CancelledError(), GeneratorExit(), SystemExit(3), MuteError()]
)
def test_whatever_a_planner_raises_is_its_failure(error):
    def raises(scene):
        raise error

    ending, records = run(world(), Scripted(raises))
    assert ending.status is EpisodeStatus.PLANNER_FAILED
    assert ending.reason.startswith(type(error).__name__)
    assert len(records) == 1


def test_a_copy_of_the_process_that_a_planner_forks_does_not_drive_on(tmp_path):
    copies = []

    def forks(scene):
        if scene.time == 0.0 and (child := os.fork()):
            copies.append(child)
        return 8.0

    ending, _ = run(world(), Scripted(forks))
    assert ending.status is EpisodeStatus.ARRIVED
    (copy,) = copies
    assert os.waitpid(copy, 0)[1] == 0
