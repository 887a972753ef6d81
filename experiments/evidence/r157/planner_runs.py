"""Drive a planner through the cells of a panel, with a light trace.

The loop is that of every episode; what is kept of a run is one row. A run ends as soon
as the conflict is over, so that thousands of them are cheap.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from experiments.cosim.conflict_world import (
    FOLLOWER,
    ConflictWorld,
    FollowerModel,
    ScriptedMotion,
)
from experiments.cosim.conflicts import STEP_S, Conflicts, LateralProfile, Sizes
from experiments.cosim.ego_driver import EpisodeOptions
from experiments.cosim.kinematic_world import constant_bounds
from experiments.cosim.loop import run_loop
from experiments.cosim.plant import PerfectTracking, Plant
from experiments.cosim.plants.tracked import PlantSettings, TrackedPlant
from experiments.cosim.plants.tube import measure_tube, planned_vehicle
from experiments.cosim.records import EpisodeStatus, StepRecord
from experiments.cosim.road import EgoTask, Road, Start
from experiments.evidence.r157.drivers import drivers_of
from experiments.evidence.r157.grids import ConflictKind, ConflictPanel
from experiments.evidence.r157.simulate import ConflictEnd
from planner.interface import Planner
from planner.prediction import held_braking
from planner.reference_drivers import ReferenceDriver
from planner.reference_drivers.braking_planner import BrakingPlanner
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Lanes
from planner.vehicle import Vehicle, VehicleLimits

START = 300.0  # of the rear axle; behind it there is room for a follower [m]
PATIENCE = 10.0  # after the other vehicle's last change [s]
WAITING_FOR_FOLLOWER = 4.0  # after the ego's conflict is over [s]
MAX_SPEED = 45.0  # of the ego [m/s]
N_LANES = 3
WHEELBASE_SHARE = 0.6  # of the ego's length
ACTUATORS: Final = "autoware"  # preset of a plant that is not perfect
SAME = 1e-6  # [m]


@dataclass(frozen=True, slots=True)
class RunSettings:
    """What all runs of a study share."""

    sizes: Sizes = field(default_factory=Sizes)
    profile: LateralProfile = LateralProfile.LINEAR
    side: float = -1.0  # from which a vehicle cuts in: 1 left, -1 right
    follower: bool = False
    plant: PlantSettings | None = None  # None: the ego is where its plan says


class RunRow(NamedTuple):
    """What is kept of one run."""

    outcome: int  # value of `ConflictEnd`
    impact_speed: float  # relative to the other vehicle, 0 without a collision [m/s]
    hardest_braking: float  # of the ego [m/s²]
    left_lane: bool
    follower_braking: float  # hardest, 0 without a follower [m/s²]
    follower_hit: bool  # the follower ran into the ego
    duration: float  # [s]


class _ConflictOver(Exception):  # noqa: N818 - an ending, not an error
    """Ends the loop of a run."""


def drive_cells(
    planner: Planner, panel: ConflictPanel, rows: Sequence[int], settings: RunSettings
) -> list[RunRow]:
    """Drive a planner through some cells of a panel.

    Args:
        planner: Any; its memory starts empty in each cell.
        panel: The panel.
        rows: Indices of its flattened cells.
        settings: Of the runs.
    """
    # A reference driver keeps its own distance, all others the careful human's.
    model = planner.driver if isinstance(planner, BrakingPlanner) else None
    x, y = tuple(panel.x.tolist()), tuple(panel.y.tolist())
    same = panel.kind, panel.ego_kmh, panel.other_kmh, x, y
    conflicts = _conflicts(same, model, settings.sizes, settings.profile)
    speeds = panel.ego_speed()
    road = _road(settings.sizes, float(speeds.max()) * len(conflicts.other_speed))
    return [
        _drive(
            planner,
            _task(road, settings.sizes, float(speeds[row])),
            road,
            panel.motions(conflicts, row, settings.side),
            settings,
        )
        for row in rows
    ]


@lru_cache(maxsize=1)
def _conflicts(
    same: tuple[ConflictKind, int, int, tuple[float, ...], tuple[float, ...]],
    model: ReferenceDriver | None,
    sizes: Sizes,
    profile: LateralProfile,
) -> Conflicts:
    """Build the conflicts of a panel once for all batches of it in a process.

    Args:
        same: The fields of the panel.
        model: Whose distance to the leader is kept.
        sizes: Of vehicles and lane.
        profile: Of the lateral motion of a cut-in.
    """
    kind, ego_kmh, other_kmh, x, y = same
    panel = ConflictPanel(kind, ego_kmh, other_kmh, np.array(x), np.array(y))
    return panel.conflicts(model, sizes, profile)


def reference_planner(panel: ConflictPanel, name: str) -> BrakingPlanner | None:
    """Return a reference driver as the planner of a panel; None for other names."""
    driver = drivers_of(panel.kind).get(name)
    return None if driver is None else BrakingPlanner(driver)


class _LightTrace:
    """Collects the row of a run and ends it when the conflict is over."""

    def __init__(
        self,
        world: ConflictWorld,
        task: EgoTask,
        motions: tuple[ScriptedMotion, ...],
        settings: RunSettings,
    ) -> None:
        self._world, self._task, self._settings = world, task, settings
        self._other = motions[0]
        self._speed_settled = bool(np.all(self._other.speed == self._other.speed[0]))
        self._settled = self._other.settled
        self._speed: float | None = None
        self._over_at: float | None = None
        self.hardest = self.follower_braking = self.impact = self.time = 0.0
        self.left_lane = self.follower_hit = False
        self.outcome = ConflictEnd.AVOIDED

    def __call__(self, record: StepRecord) -> None:
        """Take in one step."""
        ego, self.time = record.ego, record.time
        if self._speed is not None:
            self.hardest = max(self.hardest, (self._speed - ego.speed) / STEP_S)
        self._speed = ego.speed
        users = record.traffic.vehicles
        if self._settings.follower:
            braking = -float(users.acceleration[users.ids.index(FOLLOWER)])
            self.follower_braking = max(self.follower_braking, braking)
        if record.contacts:
            self._take_contact(record)
            return
        if record.ego_frenet is None:
            return
        self._watch_lane(record.ego_frenet.l, ego.heading)
        if self._over_at is None and self._is_over(record):
            self._over_at = record.time
        if self._over_at is not None:
            waited = record.time - self._over_at
            if not self._settings.follower or waited >= WAITING_FOR_FOLLOWER:
                raise _ConflictOver

    def row(self) -> RunRow:
        """Return the row of the run."""
        return RunRow(
            int(self.outcome),
            self.impact,
            self.hardest,
            self.left_lane,
            self.follower_braking,
            self.follower_hit,
            self.time,
        )

    def _take_contact(self, record: StepRecord) -> None:
        """Record who touched the ego, and how fast."""
        if set(record.contacts) == {FOLLOWER}:
            self.follower_hit = True
            return
        hit = next(name for name in record.contacts if name != FOLLOWER)
        users, ego = record.traffic.vehicles, record.ego
        row = users.ids.index(hit)
        forward, left = float(users.speed[row]), float(users.lateral_speed[row])
        self.impact = math.hypot(
            ego.speed * math.cos(ego.heading) - forward,
            ego.speed * math.sin(ego.heading) - left,
        )
        ahead = float(users.x[row]) < ego.x + self._task.vehicle.centre_offset
        self.outcome = (
            ConflictEnd.SIDE_COLLISION if ahead else ConflictEnd.REAR_COLLISION
        )

    def _watch_lane(self, l: float, heading: float) -> None:
        """Record whether the ego's body reaches over the lines of its lane."""
        vehicle = self._task.vehicle
        sin, cos = math.sin(heading), math.cos(heading)
        centre = l + vehicle.centre_offset * sin
        reach = abs(centre) + 0.5 * (vehicle.width * cos + vehicle.length * abs(sin))
        if reach > 0.5 * self._settings.sizes.lane_width + SAME:
            self.left_lane = True

    def _is_over(self, record: StepRecord) -> bool:
        """Return whether nothing can happen any more, as for the reference drivers."""
        assert record.ego_frenet is not None  # noqa: S101 - checked by the caller
        vehicle, sizes = self._task.vehicle, self._settings.sizes
        s, l, speed = self._world.place(0)
        rear = s - 0.5 * sizes.other_length
        gap = rear - (record.ego_frenet.s + vehicle.front_reach)
        inside = abs(l) < 0.5 * (sizes.ego_width + sizes.other_width)
        settled = self._speed_settled or record.index >= self._settled
        if gap <= -(sizes.ego_length + sizes.other_length):
            return inside or (settled and record.ego.speed >= speed)
        return settled and inside and gap >= 0.0 and record.ego.speed <= speed


def _drive(
    planner: Planner,
    task: EgoTask,
    road: Road,
    motions: tuple[ScriptedMotion, ...],
    settings: RunSettings,
) -> RunRow:
    """Drive one cell."""
    follower = FollowerModel() if settings.follower else None
    world = ConflictWorld(road, task, motions, follower)
    trace = _LightTrace(world, task, motions, settings)
    last = max(motion.settled for motion in motions)
    options = EpisodeOptions(
        duration=last * STEP_S + PATIENCE,
        blocked_after=math.inf,
        predictor=held_braking,
        planned_body=_planned_body(settings.plant, task),
    )
    try:
        ending = run_loop(world, planner, _plant(settings.plant), task, options, trace)
    except _ConflictOver:
        return trace.row()
    if ending.status not in (EpisodeStatus.COLLISION, EpisodeStatus.TIMEOUT):
        trace.outcome = ConflictEnd.FAILED
    return trace.row()


def _plant(settings: PlantSettings | None) -> Plant:
    """Make the plant of a run."""
    return PerfectTracking() if settings is None else TrackedPlant(settings, STEP_S)


def _planned_body(settings: PlantSettings | None, task: EgoTask) -> Vehicle | None:
    """Return the body that plans keep clear: the ego's, grown by the plant's tube."""
    if settings is None:
        return None
    speed = task.target_speed
    bounds = measure_tube(settings).upto(speed)
    return planned_vehicle(task.vehicle, settings, bounds, speed)


def _road(sizes: Sizes, way: float) -> Road:
    """Return a straight road of three lanes with the ego's in the middle."""
    length = START + way * STEP_S + 500.0
    path = ReferencePath.from_segments([line(length)])
    centres = sizes.lane_width * np.array([-1.0, 0.0, 1.0])
    lanes = Lanes(np.zeros(1), centres[:, None], np.full((3, 1), sizes.lane_width))
    return Road(path, constant_bounds(path, 0.5 * N_LANES * sizes.lane_width), lanes)


def _task(road: Road, sizes: Sizes, speed: float) -> EgoTask:
    """Return the ego's task at a speed [m/s]."""
    vehicle = Vehicle(
        sizes.ego_length,
        sizes.ego_width,
        wheelbase=WHEELBASE_SHARE * sizes.ego_length,
        rear_overhang=0.2 * sizes.ego_length,
        limits=VehicleLimits(max_speed=MAX_SPEED),
    )
    goal = road.path.length - sizes.ego_length
    return EgoTask(vehicle, goal, speed, Start(START, 0.0, speed))
