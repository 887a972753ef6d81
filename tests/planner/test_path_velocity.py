import numpy as np

from planner.path_velocity import trajectory_on
from planner.states import Path, SpeedProfile


def test_points_between_those_of_a_sharp_bend_are_on_the_arc():
    radius, gap = 8.0, 1.0
    angle = np.arange(0.0, 12.0, gap) / radius
    x, y = radius * np.sin(angle), radius * (1.0 - np.cos(angle))
    distance = gap * np.arange(angle.size)
    bend = np.full(angle.size, 1.0 / radius)
    for side in (1.0, -1.0):
        path = Path(
            distance, x, side * y, side * angle, side * bend, distance, np.zeros_like(x)
        )
        t = np.linspace(0.0, 2.0, 41)
        speed, still = np.full(t.size, 5.0), np.zeros(t.size)
        made = trajectory_on(path, SpeedProfile(t, 5.0 * t, speed, still, still))
        off = np.hypot(made.x, made.y - side * radius) - radius
        assert np.abs(off).max() < 1e-4
