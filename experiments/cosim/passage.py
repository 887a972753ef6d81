"""How much room is left beside a body that stands in the ego's way."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, RoadBounds, RoadUsers
from planner.states import BoolArray, FloatArray

WITHIN = 1.0  # between places where the road's edges are looked at [m]


@dataclass(frozen=True, slots=True, eq=False)
class BodiesAlongPath:
    """Bodies in coordinates along a path; arrays are (n,)."""

    ids: tuple[str, ...]
    s: FloatArray  # of their centres [m]
    l: FloatArray  # [m]
    half_length: FloatArray  # along the path [m]
    half_width: FloatArray  # across it [m]
    stands: BoolArray

    @classmethod
    def of(
        cls,
        path: ReferencePath,
        obstacles: Obstacles,
        users: RoadUsers,
        standing: float,
    ) -> Self:
        """Place obstacles, then vehicles along a path.

        Args:
            path: Of the ego.
            obstacles: Static bodies.
            users: Vehicles, now.
            standing: A vehicle slower than this stands [m/s].
        """
        x, y = np.append(obstacles.x, users.x), np.append(obstacles.y, users.y)
        s, l = path.project(x, y)
        along = np.array([path.pose(float(place))[2] for place in s])
        turned = np.append(obstacles.heading, users.heading) - along
        cos, sin = np.abs(np.cos(turned)), np.abs(np.sin(turned))
        half_length = 0.5 * np.append(obstacles.length, users.length)
        half_width = 0.5 * np.append(obstacles.width, users.width)
        radius = np.append(obstacles.radius, np.zeros(len(users.ids)))
        fixed = np.ones(len(obstacles.ids), dtype=np.bool_)
        return cls(
            (*obstacles.ids, *users.ids),
            s,
            l,
            half_length * cos + half_width * sin + radius,
            half_length * sin + half_width * cos + radius,
            np.append(fixed, np.abs(users.speed) < standing),
        )


def room_beside(
    bodies: BodiesAlongPath, k: int, road: RoadBounds
) -> tuple[float, float]:
    """Compute the free width to the left and to the right of a body [m], at least 0.

    It is taken where the road is narrowest beside the body, and ends at what else
    stands there. What stands beside it without a space between counts to the body.
    """
    begin = float(bodies.s[k] - bodies.half_length[k])
    end = float(bodies.s[k] + bodies.half_length[k])
    beside = bodies.stands & (bodies.s - bodies.half_length < end)
    beside &= bodies.s + bodies.half_length > begin
    low, high = bodies.l - bodies.half_width, bodies.l + bodies.half_width
    order = np.argsort(low[beside])
    row = _joined(np.array([low[beside][order], high[beside][order]]))
    own = int(np.argmax(row[1] >= bodies.l[k]))
    places = np.linspace(begin, end, max(int((end - begin) / WITHIN) + 1, 2))
    left = float(np.interp(places, road.s, road.left).min())
    right = float(np.interp(places, road.s, road.right).max())
    if own + 1 < row.shape[1]:
        left = min(left, float(row[0, own + 1]))
    if own > 0:
        right = max(right, float(row[1, own - 1]))
    return max(left - float(row[1, own]), 0.0), max(float(row[0, own]) - right, 0.0)


def _joined(spans: FloatArray) -> FloatArray:
    """Join spans that overlap; begins and ends as rows, in order of the begins."""
    out: list[list[float]] = []
    for begin, end in spans.T.tolist():
        if out and begin <= out[-1][1]:
            out[-1][1] = max(out[-1][1], end)
        else:
            out.append([begin, end])
    return np.array(out).T
