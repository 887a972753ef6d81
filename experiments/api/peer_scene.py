"""A scene as the peers' own classes."""

import math
from typing import Any

import numpy as np

from planner.scene import Scene
from planner.states import FloatArray
from planner.vehicle import Vehicle

BEHIND, AHEAD = 20.0, 150.0  # of the ego, of the lanes handed over [m]
STATION = 2.0  # between their points [m]
BEND_TIME = 4.0  # for which bends ahead cap the speed [s]
WALL = 0.5  # length of a closed stop line [m]


def vehicle_params(vehicle: Vehicle) -> Any:
    """Return the ego's size and limits in their words."""
    import fiss_planner as fp

    params, limits = fp.VehicleParams(), vehicle.limits
    params.length, params.width = vehicle.length, vehicle.width
    params.wheelbase = vehicle.wheelbase
    params.rear_axle_to_center = vehicle.centre_offset
    params.max_accel, params.max_decel = (
        limits.max_acceleration,
        limits.max_deceleration,
    )
    params.max_speed = limits.max_speed
    params.max_lat_accel = limits.max_lateral_acceleration
    params.max_steer = math.atan(limits.max_curvature * vehicle.wheelbase)
    return params


def corridor(scene: Scene) -> Any:
    """Return the lanes about the ego, or the road between its bounds."""
    import fiss_planner as fp

    s = scene.ego_frenet.s
    stations = np.arange(
        max(s - BEHIND, 0.0), min(s + AHEAD, scene.path.length), STATION
    )
    corridor = fp.Corridor(stations.tolist())
    lanes = scene.lanes
    centres, widths = lanes.at(s)
    rows = [k for k in range(centres.size) if widths[k] > 0.0]
    if not rows:
        left, right = scene.road.at(stations)
        corridor.add_lane(_band(0, 0, 0.5 * (left + right), left, right))
        return corridor
    own = min(rows, key=lambda k: abs(centres[k] - scene.ego_frenet.l))
    for k in rows:
        centre = np.interp(stations, lanes.s, lanes.centre[k])
        half = 0.5 * np.interp(stations, lanes.s, lanes.width[k])
        corridor.add_lane(_band(k, k - own, centre, centre + half, centre - half))
    return corridor


def _band(
    number: int, offset: int, centre: FloatArray, left: FloatArray, right: FloatArray
) -> Any:
    """Return a lane in their words."""
    import fiss_planner as fp

    band = fp.LaneBand()
    band.lane_id, band.offset = number, offset
    band.center, band.left, band.right = centre.tolist(), left.tolist(), right.tolist()
    band.change_allowed = True
    band.speed_limit = math.inf
    return band


def bodies(scene: Scene) -> list[Any]:
    """Return vehicles, obstacles and closed lines in their words."""
    return [*_vehicles(scene), *_standing(scene), *_walls(scene)]


def _vehicles(scene: Scene) -> list[Any]:
    """Return the vehicles with their predictions."""
    import fiss_planner as fp

    vehicles, ahead = scene.vehicles, scene.vehicles.prediction
    times = (ahead.step * np.arange(ahead.x.shape[1])).tolist()
    return [
        fp.Obstacle.from_arrays(
            k,
            float(vehicles.length[k]),
            float(vehicles.width[k]),
            times,
            ahead.x[k].tolist(),
            ahead.y[k].tolist(),
            ahead.heading[k].tolist(),
            is_static=False,
        )
        for k in range(len(vehicles.ids))
    ]


def _standing(scene: Scene) -> list[Any]:
    """Return the obstacles, discs as squares."""
    bodies = scene.obstacles
    grown = 2.0 * bodies.radius
    return [
        _box(-1 - k, *numbers)
        for k, numbers in enumerate(
            zip(
                bodies.x.tolist(),
                bodies.y.tolist(),
                bodies.heading.tolist(),
                (bodies.length + grown).tolist(),
                (bodies.width + grown).tolist(),
                strict=True,
            )
        )
    ]


def _walls(scene: Scene) -> list[Any]:
    """Return a wall behind every closed stop line that is ahead."""
    front = scene.ego_frenet.s + scene.vehicle.front_reach
    walls = []
    for number, line in enumerate(scene.stop_lines):
        if line < front - WALL:
            continue
        x, y, heading = scene.path.pose(line + 0.5 * WALL)
        left, right = (float(v) for v in scene.road.at(np.array(line)))
        middle = 0.5 * (left + right)
        place = (x - middle * math.sin(heading), y + middle * math.cos(heading))
        walls.append(_box(-100_000 - number, *place, heading, WALL, left - right))
    return walls


def _box(
    number: int, x: float, y: float, heading: float, length: float, width: float
) -> Any:
    """Return a standing body in their words."""
    import fiss_planner as fp

    return fp.Obstacle.from_arrays(
        number, length, width, [0.0], [x], [y], [heading], is_static=True
    )


def speed_cap(scene: Scene) -> float:
    """Return the target speed, less in bends [m/s]."""
    reach = max(scene.ego.speed, 1.0) * BEND_TIME
    s = scene.ego_frenet.s + np.arange(0.0, reach, STATION)
    bend = float(
        np.abs(scene.path.at(np.minimum(s, scene.path.length)).curvature).max()
    )
    most = scene.vehicle.limits.max_lateral_acceleration
    return min(scene.target_speed, math.sqrt(most / max(bend, 1e-9)))
