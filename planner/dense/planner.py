"""The planner of dense obstacles: path, then speed along it, replanned each cycle."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from planner.bodies import Bodies, bodies_of, touched_by
from planner.contact_check import Contact, contacts_of
from planner.dense.field import Cover, field_of
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.path_ladder import ChosenPath, PathTask, choose_path
from planner.dense.reasons import no_passage, no_path, no_speed, standstill
from planner.dense.settings import DenseSettings
from planner.dense.speed import DrivablePath, knot_times, plan_drive
from planner.dense.turning import Momentum, Turning
from planner.dense.vehicles_ahead import bound_by_vehicles
from planner.dense.vehicles_behind import cut_off_by
from planner.fallback.behind import behind
from planner.fallback.ladder import fallback
from planner.interface import PlanResult, PlanStats, PlanStatus
from planner.path_velocity import trajectory_on
from planner.reference_path.frenet_lines import line_in_plane
from planner.scene import Scene
from planner.scene_checks import invalid
from planner.states import BoolArray, Path, SpeedProfile, Trajectory
from planner.vehicle import VehicleLimits

HARD_GAP = 0.02  # least distance to a body that a fallback may leave [m]
AT_THE_END = 1.0  # within it of the bound, a vehicle is what holds the ego up [m]


@dataclass(frozen=True, slots=True)
class DenseMemory:
    """State handed from one cycle to the next."""

    trajectory: Trajectory | None = None
    sides: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class DensePlanner:
    """Plan a path through static obstacles and the speed along it; `plan` is pure."""

    settings: DenseSettings

    def plan(self, scene: Scene, memory: object) -> PlanResult:
        """Plan one cycle; see `planner.interface.Planner`."""
        reason = invalid(scene)
        if reason is not None:
            stats = PlanStats(reason=reason)
            return PlanResult(PlanStatus.INVALID_SCENE, None, memory, stats)
        last = memory if isinstance(memory, DenseMemory) else DenseMemory()
        task = self._task(scene)
        chosen = choose_path(task, last.sides, self.settings)
        if chosen is None:
            why = no_path(task.field, scene)
            return _fall_back(scene, last, why, self.settings)
        path = self._in_plane(scene, chosen)
        if path is None:
            return _fall_back(
                scene, last, "the path leaves the road's frame", self.settings
            )
        way, blockers = self._drivable(scene, chosen, path)
        profile = plan_drive(way, scene, self.settings.drive)
        if profile is None:
            why = no_speed(scene, way, blockers, chosen.blocked_by)
            return _fall_back(scene, last, why, self.settings)
        trajectory = trajectory_on(path, profile)
        cut_off = cut_off_by(trajectory, scene)
        if cut_off.any():
            behind, who = self._drivable(scene, chosen, path, cut_off)
            slower = plan_drive(behind, scene, self.settings.drive)
            if slower is not None:  # else it is too late to let them by
                way, blockers, profile = behind, who, slower
                trajectory = trajectory_on(path, profile)
        blocker = chosen.blocked_by or _holding(profile, way, blockers)
        if chosen.ended:
            least = self.settings.margins[-1]
            reason = no_passage(chosen, task.field, scene, least)
        else:
            reason = standstill(scene, trajectory, blocker)
        return _result(chosen, trajectory, reason, blocker)

    def _task(self, scene: Scene) -> PathTask:
        """Return where the path has to lead."""
        settings, vehicle, ego = self.settings, scene.vehicle, scene.ego_frenet
        drive = settings.drive
        speed = max(scene.target_speed, scene.ego.speed)
        need = speed * drive.duration + speed**2 / (2.0 * drive.braking)
        horizon = max(settings.horizon, need)
        return PathTask(
            field_of(scene, horizon),
            Cover.of(vehicle, settings.road_margin),
            PathStart(ego.s, ego.l, ego.l_prime, ego.l_second),
            ego.s + horizon,
            settings.curvature_share * vehicle.limits.max_curvature,
            Momentum(scene.ego.speed, scene.ego.curvature),
            turnings_of(settings, vehicle.limits),
        )

    def _in_plane(self, scene: Scene, chosen: ChosenPath) -> Path | None:
        """Move the path to the plane."""
        fine = chosen.path.subdivided(self.settings.spacing)
        return line_in_plane(scene.path, fine.s, fine.l, fine.slope, fine.second)

    def _drivable(
        self,
        scene: Scene,
        chosen: ChosenPath,
        path: Path,
        yield_to: BoolArray | None = None,
    ) -> tuple[DrivablePath, list[str | None]]:
        """Bound how far along the path the ego may go: obstacles, lines, vehicles."""
        reach = scene.vehicle.front_reach
        lines = [s - reach for s in scene.stop_lines if s > scene.ego_frenet.s]
        end_s = min([chosen.end_s, *lines])
        end = float(np.interp(end_s, path.s, path.distance))
        times = knot_times(self.settings.drive)
        bound, blockers = bound_by_vehicles(
            path, scene, times, self.settings.drive.vehicle_gap, yield_to
        )
        return DrivablePath(path, end, bound), blockers


def turnings_of(settings: DenseSettings, limits: VehicleLimits) -> tuple[Turning, ...]:
    """Return what a path may take: comfortable, and firm."""
    drive, share = settings.drive, settings.firm_share
    comfortable = drive.lateral_share * limits.max_lateral_acceleration
    firm = share * limits.max_lateral_acceleration
    return (
        Turning(comfortable, drive.braking),
        Turning(firm, share * limits.max_deceleration),
    )


def _holding(
    profile: SpeedProfile, way: DrivablePath, blockers: list[str | None]
) -> str | None:
    """Name the vehicle that the drive comes nearest to, if it is held up by one."""
    rooms = way.ahead - profile.distance
    nearest = int(np.argmin(rooms))
    return blockers[nearest] if rooms[nearest] < AT_THE_END else None


def _result(
    chosen: ChosenPath, trajectory: Trajectory, reason: str, blocker: str | None
) -> PlanResult:
    """Make the result of the cycle."""
    passed = "".join("L" if side > 0.0 else "R" for side in chosen.sides.values())
    stats = PlanStats(
        reason=reason,
        candidates=chosen.candidates,
        survivors=1,
        costs={"path": chosen.cost},
        blocker=blocker,
        explanation=f"sides {passed or '-'}, margin {chosen.margin:g} m",
    )
    memory = DenseMemory(trajectory, chosen.sides)
    return PlanResult(PlanStatus.OK, trajectory, memory, stats)


def _fall_back(
    scene: Scene, last: DenseMemory, reason: str, settings: DenseSettings
) -> PlanResult:
    """Fall back where nothing can be planned, with the reason."""
    duration = settings.drive.duration
    bodies = bodies_of(scene, round(duration / scene.step) + 1)

    theirs = behind(scene, bodies)

    def blocker(trajectory: Trajectory) -> str | None:
        return touched_body(scene, bodies, trajectory, theirs)

    def contacts(trajectory: Trajectory, margin: float) -> tuple[Contact, ...]:
        return contacts_of(trajectory, scene.vehicle, bodies, theirs, margin)

    status, trajectory = fallback(scene, last.trajectory, blocker, duration, contacts)
    memory = DenseMemory(trajectory, last.sides)
    stats = PlanStats(reason=reason, blocker=blocker(trajectory))
    return PlanResult(status, trajectory, memory, stats)


def touched_body(
    scene: Scene,
    bodies: Bodies,
    trajectory: Trajectory,
    theirs: BoolArray | None = None,
) -> str | None:
    """Name the obstacle or vehicle that a trajectory would touch, None if none.

    Those do not count whose part it is to keep clear: `theirs`, (n,), or followers.
    """
    cover = Cover.of(scene.vehicle)
    return touched_by(
        trajectory,
        bodies,
        bodies.table.follower if theirs is None else theirs,
        cover.offsets,
        cover.radius,
        HARD_GAP,
    )
