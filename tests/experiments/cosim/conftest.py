"""Small worlds that several tests share."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from experiments.cosim.road import EgoTask, Road, Start
from experiments.cosim.sumo import settings
from experiments.cosim.sumo import world as sumo_world
from experiments.cosim.sumo.ghost_vehicle import Ghost
from experiments.cosim.sumo.world import SumoWorld
from planner.reference_path.path import ReferencePath
from planner.reference_path.segments import line
from planner.scene import Obstacles, RoadBounds
from planner.states import CartesianState
from planner.vehicle import Vehicle
from sumo_nets.catalogue import network
from sumo_nets.route_path import StopLine

# Background cars here obey to the letter: no lane changes of their own, no dawdling.
CALM = (
    'speedDev="0" sigma="0" lcStrategic="0" lcCooperative="0" '
    'lcSpeedGain="0" lcKeepRight="0"'
)
EGO = (
    '<vType id="ego" length="4.8" width="1.9" minGap="0" decel="4.5" '
    'apparentDecel="4.5" emergencyDecel="8" maxSpeed="20" speedDev="0" sigma="0"/>'
)


def quintic(t: float, begin: float, duration: float) -> float:
    """Rise smoothly from 0 to 1 between begin and begin + duration."""
    a = min(max((t - begin) / duration, 0.0), 1.0)
    return 10.0 * a**3 - 15.0 * a**4 + 6.0 * a**5


@pytest.fixture
def route_file(tmp_path: Path) -> Callable[[str], Path]:
    """Write a route file for the straight road from vehicle elements."""

    def write(vehicles: str = "", *, car: str = 'speedFactor="1"') -> Path:
        path = tmp_path / "demand.rou.xml"
        routes = "".join(
            f'<route id="{edge}" edges="{edge}"/>'
            for edge in ("own", "oncoming")
            if f'route="{edge}"' in vehicles
        )
        path.write_text(
            f'<routes>{EGO}<vType id="car" length="4.6" width="1.8" '
            f'emergencyDecel="9" {CALM} {car}/>'
            f"{routes}{vehicles}</routes>"
        )
        return path

    return write


@pytest.fixture
def straight(
    route_file: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., SumoWorld]]:
    """Make SUMO worlds on the straight three-lane road; they are closed afterwards.

    The reference path runs along the middle lane, from x = -100 m on y = 0.
    """
    worlds: list[SumoWorld] = []

    def make(
        vehicles: str = "",
        car: str = 'speedFactor="1"',
        *,
        path: ReferencePath | None = None,
        start_s: float = 60.0,
        start_offset: float = 0.0,
        start_speed: float | None = 12.0,
        vehicle: Vehicle | None = None,
        stop_lines: tuple[StopLine, ...] = (),
        obstacles: Obstacles | None = None,
        view_radius: float | None = None,
        ghost: bool = True,
        lane_change_duration: float | None = None,
        **changes,
    ) -> SumoWorld:
        net = network("straight")
        if path is None:
            path = ReferencePath.from_segments([line(500.0)], (-100.0, 0.0, 0.0))
        bounds = RoadBounds(np.array([0.0]), np.array([5.0]), np.array([-5.0]))
        start = Start(start_s, start_offset, start_speed)
        given = {
            "net_file": net.net_file,
            "route_file": route_file(vehicles, car=car),
            "route": net.route,
            "road": Road(
                path,
                bounds,
                stop_lines=stop_lines,
                obstacles=obstacles or Obstacles.none(),
            ),
            "task": EgoTask(vehicle or Vehicle(), path.length, 13.0, start),
            "warm_up": 0.0,
        }
        if view_radius is not None:
            monkeypatch.setattr(sumo_world, "VIEW_RADIUS", view_radius)
        if lane_change_duration is not None:
            monkeypatch.setattr(settings, "LANE_CHANGE_DURATION", lane_change_duration)
        if not ghost:
            monkeypatch.setattr(Ghost, "update", lambda *given, before_line: given[-1])
        world = SumoWorld(settings.SumoSettings(**(given | changes)))
        worlds.append(world)
        return world

    yield make
    for world in worlds:
        world.close()


@pytest.fixture
def lane_change() -> Callable[..., CartesianState]:
    """Move a rear axle one lane over while it drives on."""

    def state(  # the ego at time t
        start: CartesianState,
        t: float,
        *,
        width: float = 10.0 / 3.0,
        begin: float = 0.0,
        duration: float = 6.0,
    ) -> CartesianState:
        v, h = start.speed, 1e-4
        y = width * quintic(t, begin, duration)
        ahead = width * quintic(t + h, begin, duration)
        heading = math.atan2(ahead - y, v * h)
        return CartesianState(start.x + v * t, start.y + y, heading, 0.0, v, 0.0)

    return state
