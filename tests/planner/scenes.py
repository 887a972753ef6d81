"""Small scenes for the planner's tests, and a loop that drives them without a world."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.interface import Planner, PlanResult
from planner.prediction import constant_speed
from planner.reference_path.frenet import cartesian_to_frenet_one
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import arc, clothoid, line
from planner.scene import (
    Obstacles,
    Prediction,
    RoadBounds,
    RoadUsers,
    Scene,
    Vehicles,
)
from planner.shapes.rectangles import Rectangle, corners, distance
from planner.states import CartesianState, FloatArray, FrenetState, Trajectory
from planner.vehicle import Vehicle

STEP = 0.1
TARGET = 50.0 / 3.6
DENSE = 5  # looks between two points of a trajectory


@dataclass(frozen=True)
class Disc:
    """A round obstacle on the path."""

    s: float
    l: float
    radius: float


@dataclass(frozen=True)
class Car:
    """A vehicle on the path; a negative speed drives against it."""

    s: float
    l: float
    speed: float
    length: float = 4.8
    width: float = 1.9
    turned: float = 0.0  # heading off the lane [rad]


def straight(length: float = 400.0) -> ReferencePath:
    return ReferencePath.from_segments([line(length)])


def bend(radius: float, before: float = 60.0, turn: float = math.pi) -> ReferencePath:
    """A straight, an arc (to the right if the radius is negative), a straight."""
    return ReferencePath.from_segments(
        [line(before), arc(abs(radius) * turn, 1.0 / radius), line(150.0)]
    )


def narrow_turn(
    sharpest: float, before: float, swing: tuple[float, float]
) -> ReferencePath:
    """A turn of 4 m at its sharpest [1/m], between clothoids as long as `swing`."""
    return ReferencePath.from_segments(
        [
            line(before),
            clothoid(swing[0], 0.0, sharpest),
            arc(4.0, sharpest),
            clothoid(swing[1], sharpest, 0.0),
            line(60.0),
        ]
    )


def over_the_edge(cycles: "Sequence[Cycle]") -> float:
    """How far a corner of the ego reaches over the road's edge at most [m]."""
    most = -math.inf
    for cycle in cycles:
        scene = cycle.scene
        sides = corners(ego_rectangle(scene.ego, scene.vehicle))
        along, l = scene.path.project(sides[:, 0], sides[:, 1])
        left, right = scene.road.at(along)
        most = max(most, float((l - left).max()), float((right - l).max()))
    return most


def winding() -> ReferencePath:
    """Left and right with clothoids, R = 30 m."""
    k = 1.0 / 30.0
    return ReferencePath.from_segments(
        [
            line(20.0),
            clothoid(15.0, 0.0, k),
            arc(25.0, k),
            clothoid(30.0, k, -k),
            arc(25.0, -k),
            clothoid(15.0, -k, 0.0),
            line(100.0),
        ]
    )


def road(path: ReferencePath, left: float = 5.0, right: float = -5.0) -> RoadBounds:
    return RoadBounds(np.array([0.0, path.length]), np.full(2, left), np.full(2, right))


def place(path: ReferencePath, s: float, l: float) -> tuple[float, float, float]:
    """(x, y, heading of the path)."""
    x, y, heading = path.pose(s)
    return x - l * math.sin(heading), y + l * math.cos(heading), heading


def discs(path: ReferencePath, rows: Sequence[Disc]) -> Obstacles:
    if not rows:
        return Obstacles.none()
    x, y, heading = np.array([place(path, disc.s, disc.l) for disc in rows]).T
    none = np.zeros(len(rows))
    names = tuple(f"disc.{k}" for k in range(len(rows)))
    radius = np.array([disc.radius for disc in rows])
    return Obstacles(names, x, y, heading, none, none, radius)


def cars(
    path: ReferencePath, rows: Sequence[Car], n_steps: int = 51, step: float = STEP
) -> Vehicles:
    poses = np.array([place(path, car.s, car.l) for car in rows]).reshape(-1, 3)
    x, y, along = poses.T
    speeds = np.array([car.speed for car in rows], dtype=np.float64)
    turned = np.array([car.turned for car in rows], dtype=np.float64)
    heading = along + np.where(speeds < 0.0, math.pi, 0.0) + turned
    none = np.zeros(len(rows))
    users = RoadUsers(
        tuple(f"car.{k}" for k in range(len(rows))),
        x,
        y,
        heading,
        np.abs(speeds),
        none,
        none,
        np.array([car.length for car in rows], dtype=np.float64),
        np.array([car.width for car in rows], dtype=np.float64),
    )
    ahead = constant_speed(path, users, step * np.arange(max(n_steps, 2)))
    names = ("x", "y", "heading", "s", "l")
    kept = {name: getattr(ahead, name)[:, :n_steps] for name in names}
    return Vehicles.predicted(users, Prediction(ahead.step, **kept))


def ego_on(
    path: ReferencePath,
    s: float = 0.0,
    l: float = 0.0,
    speed: float = TARGET,
    error: float = 0.0,
    curvature: float | None = None,
    acceleration: float = 0.0,
) -> CartesianState:
    """A state whose heading is `error` off the path; it follows the path by default."""
    x, y, heading = place(path, s, l)
    if curvature is None:
        own = float(path.at(s).curvature)
        curvature = own * math.cos(error) / (1.0 - own * l)
    return CartesianState(x, y, heading + error, curvature, speed, acceleration)


def make_scene(
    path: ReferencePath,
    ego: CartesianState | None = None,
    obstacles: Obstacles | Sequence[Disc] = (),
    vehicles: Vehicles | Sequence[Car] = (),
    *,
    bounds: RoadBounds | None = None,
    stop_lines: tuple[float, ...] = (),
    target_speed: float = TARGET,
    vehicle: Vehicle | None = None,
    frenet: FrenetState | None = None,
    near: float | None = None,
    time: float = 0.0,
    full_statistics: bool = True,
) -> Scene:
    ego = ego_on(path) if ego is None else ego
    if not isinstance(obstacles, Obstacles):
        obstacles = discs(path, obstacles)
    if not isinstance(vehicles, Vehicles):
        vehicles = cars(path, vehicles)
    return Scene(
        time,
        STEP,
        ego,
        cartesian_to_frenet_one(path, ego, near) if frenet is None else frenet,
        vehicle or Vehicle(),
        path,
        road(path) if bounds is None else bounds,
        obstacles,
        vehicles,
        stop_lines,
        target_speed,
        full_statistics=full_statistics,
    )


@dataclass(frozen=True)
class Cycle:
    """One cycle of a rollout."""

    scene: Scene
    plan: PlanResult


def drive(
    planner: Planner,
    scene: Scene,
    n_cycles: int,
    traffic: Sequence[Car] = (),
    until: Callable[[Scene], bool] = lambda _: False,
) -> list[Cycle]:
    """Track each plan perfectly for one step; `traffic` keeps its speed and lane."""
    cycles: list[Cycle] = []
    memory: object = None
    for k in range(n_cycles):
        if until(scene):
            break
        plan = planner.plan(scene, memory)
        assert plan.trajectory is not None, plan.stats.reason
        cycles.append(Cycle(scene, plan))
        memory = plan.memory
        ego = plan.trajectory.at(scene.step)
        time = (k + 1) * scene.step
        moved = [replace(car, s=car.s + car.speed * time) for car in traffic]
        scene = make_scene(
            scene.path,
            ego,
            scene.obstacles,
            moved if traffic else scene.vehicles,
            bounds=scene.road,
            stop_lines=scene.stop_lines,
            target_speed=scene.target_speed,
            vehicle=scene.vehicle,
            near=scene.ego_frenet.s,
            time=time,
        )
    return cycles


def ego_rectangle(state: CartesianState, vehicle: Vehicle) -> Rectangle:
    ahead = vehicle.centre_offset
    return Rectangle(
        state.x + ahead * math.cos(state.heading),
        state.y + ahead * math.sin(state.heading),
        state.heading,
        vehicle.length,
        vehicle.width,
    )


def obstacle_rectangles(obstacles: Obstacles) -> list[Rectangle]:
    columns = ("x", "y", "heading", "length", "width", "radius")
    rows = zip(*(getattr(obstacles, name) for name in columns), strict=True)
    return [Rectangle(*(float(value) for value in row)) for row in rows]


def clearance_now(scene: Scene) -> float:
    """True distance of the ego's rectangle from the nearest obstacle."""
    ego = ego_rectangle(scene.ego, scene.vehicle)
    bodies = obstacle_rectangles(scene.obstacles)
    return min((distance(ego, body) for body in bodies), default=math.inf)


def least_clearance(cycles: Sequence[Cycle]) -> float:
    return min(clearance_now(cycle.scene) for cycle in cycles)


def clearances(scene: Scene, trajectory: Trajectory) -> FloatArray:
    """Least distance of the ego's rectangle from each obstacle, then each vehicle.

    Looked at `DENSE` times a step; vehicles where their prediction has them, held at
    its end.
    """
    vehicles, ahead = scene.vehicles, scene.vehicles.prediction
    grid = ahead.step * np.arange(ahead.x.shape[1])
    fixed = obstacle_rectangles(scene.obstacles)
    least = np.full(len(fixed) + len(vehicles.ids), np.inf)
    unwrapped = np.unwrap(ahead.heading, axis=1)
    steps = DENSE * (trajectory.t.size - 1) + 1
    for t in np.linspace(0.0, trajectory.t[-1], steps):
        ego = ego_rectangle(trajectory.at(float(t)), scene.vehicle)
        bodies = [
            Rectangle(
                float(np.interp(t, grid, ahead.x[k])),
                float(np.interp(t, grid, ahead.y[k])),
                float(np.interp(t, grid, unwrapped[k])),
                float(vehicles.length[k]),
                float(vehicles.width[k]),
            )
            for k in range(len(vehicles.ids))
        ]
        now = [distance(ego, body) for body in fixed + bodies]
        least = np.minimum(least, now)
    return least
