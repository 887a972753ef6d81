"""Roads with marked lanes for the tests of the lane change."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.reference_path.path import ReferencePath
from planner.scene import Lanes, Obstacles, RoadBounds, Scene
from tests.planner.scenes import Car, Disc, cars, ego_on, make_scene, straight

WIDTH = 3.5
N_STEPS = 101


def marked(n_lanes: int) -> Lanes:
    centres = WIDTH * (np.arange(n_lanes) - (n_lanes - 1) / 2.0)
    return Lanes(np.zeros(1), centres[:, None], np.full((n_lanes, 1), WIDTH))


def two_lanes() -> Lanes:
    return marked(2)


def on_lanes(
    *,
    lane: int = 0,
    s: float = 100.0,
    speed: float = 50.0 / 3.6,
    n_lanes: int = 2,
    path: ReferencePath | None = None,
    lanes: Lanes | None = None,
    cars: Sequence[Car] = (),
    obstacles: Obstacles | Sequence[Disc] = (),
    offset: float = 0.0,
    error: float = 0.0,
    acceleration: float = 0.0,
    target_speed: float = 50.0 / 3.6,
    time: float = 0.0,
) -> Scene:
    """The ego in the middle of a lane (plus `offset`), predictions of 10 s."""
    path = straight(1500.0) if path is None else path
    lanes = marked(n_lanes) if lanes is None else lanes
    centres, widths = lanes.at(s)
    half = 0.5 * widths.max()
    edge = RoadBounds(
        np.array([0.0, path.length]),
        np.full(2, centres.max() + half),
        np.full(2, centres.min() - half),
    )
    ego = ego_on(
        path, s, centres[lane] + offset, speed, error=error, acceleration=acceleration
    )
    scene = make_scene(
        path,
        ego,
        obstacles,
        predicted(path, cars),
        bounds=edge,
        target_speed=target_speed,
        near=s,
        time=time,
    )
    return replace(scene, lanes=lanes)


def predicted(path: ReferencePath, rows: Sequence[Car]):
    return cars(path, rows, n_steps=N_STEPS)
