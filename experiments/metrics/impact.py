"""How fast the ego and what it touches first go at each other."""

import json

import numpy as np

from experiments.trace.schema import Trace


def first_contact(trace: Trace) -> tuple[int, str] | None:
    """Return the row of the first contact and the body touched; None without one."""
    for row, cell in enumerate(trace.steps["contacts"]):
        if cell != "[]":
            bodies = json.loads(cell)
            if bodies:
                return row, str(bodies[0])
    return None


def impact_speed(trace: Trace) -> float | None:
    """Return the relative speed of the first contact [m/s].

    The length of the difference of both velocities in the first step in which they
    touch; a body that is no vehicle stands. None without a contact.
    """
    found = first_contact(trace)
    if found is None:
        return None
    row, body = found
    steps, vehicles = trace.steps, trace.vehicles
    here = vehicles["index"] == steps["index"][row]
    mine = np.flatnonzero(here & (vehicles["id"] == body))
    speed = float(steps["speed_mps"][row])
    heading = float(steps["heading_rad"][row])
    vx, vy = speed * np.cos(heading), speed * np.sin(heading)
    if mine.size:
        other = float(vehicles["speed_mps"][mine[0]])
        course = float(vehicles["heading_rad"][mine[0]])
        across = float(np.ma.filled(vehicles["lateral_speed_mps"], 0.0)[mine[0]])
        vx -= other * np.cos(course) - across * np.sin(course)
        vy -= other * np.sin(course) + across * np.cos(course)
    return float(np.hypot(vx, vy))
