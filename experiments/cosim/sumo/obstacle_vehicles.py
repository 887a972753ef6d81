"""Static obstacles as SUMO's traffic has to see them: stopped vehicles in its lanes.

SUMO blocks only the lane that a vehicle's front bumper is in, and measures its length
along that lane, whatever its heading. So every lane in which a car would touch the
obstacle gets a *twin*: a standing vehicle in the lane's centre that covers exactly the
stretch that is blocked there. The twins are for SUMO's traffic alone; the planner and
the collision monitor use `planner.scene.Obstacles`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.cosim.sumo import frames
from experiments.cosim.sumo.lanes import Lane
from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.scene import Obstacles
from planner.states import FloatArray

TRAFFIC_WIDTH = 2.0  # of a car in the centre of its lane [m]
SAMPLING = 0.1  # of the area that such a car sweeps [m]
ID_PREFIX = "static@"  # no demand file names its vehicles like this
SUMO_TYPE = "DEFAULT_VEHTYPE"  # exists in every simulation
MOVE_ANYWHERE = 6  # moveToXY: exact position, any route, any lane permission
NO_CHECKS = 32  # setSpeedMode: obey the commanded speed
INSIDE_JUNCTION = ":"  # how the names of edges there begin
# Lanes inside junctions without an area are drawn 0.1 m long. A vehicle held there
# stops all that pass in other lanes under SUMO's sublane model (1.28).
LEAST_INSIDE = 0.5  # the shortest lane inside a junction that gets a twin [m]
FOR_EVER = 1e7  # duration of a stop: longer than any simulation [s]


@dataclass(frozen=True, slots=True)
class Twin:
    """A standing vehicle that blocks one lane in place of an obstacle."""

    lane: Lane
    front: float  # arc length of its front bumper on the lane [m]
    length: float  # [m]


def twins(obstacles: Obstacles, lanes: Iterable[Lane]) -> list[Twin]:
    """Find every stretch of a lane in which a car would touch an obstacle.

    A stretch is found to within `SAMPLING`, never too short. Lanes inside junctions
    that are shorter than `LEAST_INSIDE` get none: the twins before and behind do.
    """
    found = []
    for lane in lanes:
        if lane.edge.startswith(INSIDE_JUNCTION) and lane.length < LEAST_INSIDE:
            continue
        for index in _near(obstacles, lane):
            for rear, front in blocked_stretches(obstacles, index, lane):
                found.append(Twin(lane, front, max(front - rear, SAMPLING)))
    return found


def blocked_stretches(
    obstacles: Obstacles, index: int, lane: Lane
) -> list[tuple[float, float]]:
    """Return the stretches of a lane that an obstacle blocks, as arc lengths.

    A place is blocked if the cross section of a car of `TRAFFIC_WIDTH` in the lane's
    centre would touch the obstacle there.

    Args:
        obstacles: The obstacles.
        index: Which of them.
        lane: The lane.

    Returns:
        (rear, front) of every stretch [m]; none where a car passes everywhere.
    """
    n = max(int(np.ceil(lane.length / SAMPLING)), 1) + 1
    stations = np.linspace(0.0, lane.length, n)
    x = np.interp(stations, lane.stations, lane.points[:, 0])
    y = np.interp(stations, lane.stations, lane.points[:, 1])
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    half = TRAFFIC_WIDTH / 2.0
    near = np.flatnonzero(distance(obstacles, index, x, y) <= half + SAMPLING)
    across = np.linspace(-half, half, round(TRAFFIC_WIDTH / SAMPLING) + 1)
    gap = distance(
        obstacles,
        index,
        x[near, None] - across * np.sin(heading)[near, None],
        y[near, None] + across * np.cos(heading)[near, None],
    )  # (n_near, n_across)
    touched = near[np.any(gap <= SAMPLING / 2.0, axis=1)]
    runs = np.split(touched, np.flatnonzero(np.diff(touched) > 1) + 1)
    # A body that ends where the lane does touches it without standing in it.
    inside = [r for r in runs if r.size > 1 or (r.size and 0 < r[0] < n - 1)]
    return [(float(stations[r[0]]), float(stations[r[-1]])) for r in inside]


def distance(
    obstacles: Obstacles, index: int, x: FloatArray, y: FloatArray
) -> FloatArray:
    """Distance of points from one obstacle [m], negative only inside its margin."""
    dx, dy = x - obstacles.x[index], y - obstacles.y[index]
    cos, sin = np.cos(obstacles.heading[index]), np.sin(obstacles.heading[index])
    along = np.abs(dx * cos + dy * sin) - obstacles.length[index] / 2.0
    across = np.abs(dy * cos - dx * sin) - obstacles.width[index] / 2.0
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    gap: FloatArray = outside - obstacles.radius[index]
    return gap


def place(sumo: Libsumo, placed: Sequence[Twin], route_id: str) -> frozenset[str]:
    """Add the twins to the simulation, where they stand until its end.

    SUMO's drivers treat a vehicle that has *stopped* as a closed lane, which they leave
    in time; behind one that merely has no speed they queue. Inside junctions vehicles
    cannot stop: there the speed is held at 0.

    Args:
        sumo: The running libsumo module.
        placed: The twins.
        route_id: Any route, for those inside junctions.

    Returns:
        The ids of the vehicles made.

    Raises:
        libsumo.TraCIException: If SUMO refuses; the session wraps it.
    """
    for number, twin in enumerate(placed):
        name = f"{ID_PREFIX}{number}"
        if twin.lane.edge.startswith(INSIDE_JUNCTION):
            _hold(sumo, name, twin, route_id)
        else:
            _stop(sumo, name, twin)
    return frozenset(f"{ID_PREFIX}{number}" for number in range(len(placed)))


def _add(sumo: Libsumo, name: str, twin: Twin, route_id: str) -> None:
    """Add a twin that SUMO does not move; it has no place yet."""
    vehicles = sumo.vehicle
    vehicles.add(name, route_id, typeID=SUMO_TYPE, departSpeed="0")
    vehicles.setLength(name, twin.length)
    vehicles.setWidth(name, TRAFFIC_WIDTH)
    vehicles.setMinGap(name, 0.0)
    vehicles.setSpeedMode(name, NO_CHECKS)
    vehicles.setLaneChangeMode(name, 0)


def _stop(sumo: Libsumo, name: str, twin: Twin) -> None:
    """Make a twin that has stopped at its place."""
    edge, index = twin.lane.edge, twin.lane.index
    route = f"route@{name}"
    sumo.route.add(route, [edge])
    _add(sumo, name, twin, route)
    # SUMO may count a lane longer or shorter than it is drawn.
    length = float(sumo.lane.getLength(twin.lane.id))
    position = min(twin.front * length / twin.lane.length, length)
    sumo.vehicle.moveTo(name, twin.lane.id, position)
    sumo.vehicle.setStop(name, edge, position, index, FOR_EVER)


def _hold(sumo: Libsumo, name: str, twin: Twin, route_id: str) -> None:
    """Make a twin whose speed is held at 0."""
    _add(sumo, name, twin, route_id)
    sumo.vehicle.setSpeed(name, 0.0)
    x, y, heading = twin.lane.at(twin.front)
    angle = frames.angle_from_heading(heading)
    edge, index = twin.lane.edge, twin.lane.index
    sumo.vehicle.moveToXY(name, edge, index, x, y, angle, MOVE_ANYWHERE)


def _near(obstacles: Obstacles, lane: Lane) -> list[int]:
    """Return the indices of obstacles near the box around a lane."""
    reach = (
        np.hypot(obstacles.length, obstacles.width) / 2.0
        + obstacles.radius
        + TRAFFIC_WIDTH
    )
    low, high = lane.points.min(axis=0), lane.points.max(axis=0)
    near = (
        (obstacles.x + reach > low[0])
        & (obstacles.x - reach < high[0])
        & (obstacles.y + reach > low[1])
        & (obstacles.y - reach < high[1])
    )
    return [int(i) for i in np.flatnonzero(near)]
