"""Made-up motions up to a contact, step by step, in a plane with x along the road."""

from collections.abc import Callable

import numpy as np

from experiments.metrics.verdict.overlap import overlap, rows_of
from experiments.metrics.verdict.records import BodyTrack, ContactCase

STEP = 0.1
LONGEST = 20.0  # [s]
Shape = Callable[[np.ndarray], np.ndarray]


def track(
    x: float,
    y: float,
    speed: float,
    *,
    heading: float = 0.0,
    braking: float = 0.0,
    from_t: float = 0.0,
    side: float = 0.0,
    side_at: float = 0.0,
    side_s: float = 2.0,
    appears: float = 0.0,
    length: float = 4.8,
    width: float = 1.9,
) -> BodyTrack:
    """Drive straight; brake from a time on; move sideways by `side` in `side_s`."""
    t = np.arange(0.0, LONGEST, STEP)
    late = np.maximum(t - from_t, 0.0)
    moving = np.minimum(late, speed / braking) if braking > 0.0 else late
    along = speed * np.minimum(t, from_t) + speed * moving - 0.5 * braking * moving**2
    share = np.clip((t - side_at) / side_s, 0.0, 1.0)
    across = side * share**2 * (3.0 - 2.0 * share)
    pace = np.maximum(speed - braking * late, 0.0) if braking > 0.0 else speed + 0.0 * t
    cos, sin = np.cos(heading), np.sin(heading)
    px = x + along * cos - across * sin
    py = y + along * sin + across * cos
    px[t < appears - 1e-9] = np.nan
    rate = np.where((late > 0.0) & (pace > 0.0), -braking, 0.0)
    turned = heading + np.arctan2(np.gradient(across, t), np.maximum(pace, 1.0))
    return BodyTrack(px, py, turned, pace, rate, length, width)


def until(track: BodyTrack, last: int) -> BodyTrack:
    """Cut a track after a step."""
    end = last + 1
    return BodyTrack(
        track.x[:end],
        track.y[:end],
        track.heading[:end],
        track.speed[:end],
        track.acceleration[:end],
        track.length,
        track.width,
    )


def contact(
    ego: BodyTrack,
    other: BodyTrack,
    *bystanders: BodyTrack,
    road: tuple[float, float] = (5.25, -5.25),
    **facts: object,
) -> ContactCase:
    """Cut all tracks at the first step in which ego and other touch."""
    hits = np.flatnonzero(overlap(rows_of(ego), rows_of(other)))
    assert hits.size, "they never touch"
    last = int(hits[0])
    assert last > 0, "they touch from the start on"
    kept = until(ego, last)
    return ContactCase(
        STEP,
        kept,
        until(other, last),
        road[0] - 0.5 * ego.width - kept.y,
        kept.y - 0.5 * ego.width - road[1],
        tuple(until(one, last) for one in bystanders),
        **facts,
    )
