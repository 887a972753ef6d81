"""Static bodies that are given along the road, and their places in the plane."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles


@dataclass(frozen=True, slots=True)
class PlacedBody:
    """A static body given along the road: rectangle grown by `radius`."""

    id: str
    s: float  # centre, along the reference path [m]
    l: float  # centre, positive to the left [m]
    length: float = 0.0  # [m]
    width: float = 0.0  # [m]
    radius: float = 0.0  # [m]
    heading: float = 0.0  # against the reference path [rad]


def obstacles_on_path(path: ReferencePath, bodies: Sequence[PlacedBody]) -> Obstacles:
    """Return bodies that are given along the road as obstacles in the plane.

    Args:
        path: The reference path.
        bodies: Discs, rectangles or rounded rectangles.

    Returns:
        The obstacles, in the same order.
    """
    column = {
        name: np.array([getattr(body, name) for body in bodies], dtype=np.float64)
        for name in ("s", "l", "length", "width", "radius", "heading")
    }
    point = path.at(column["s"])
    return Obstacles(
        tuple(body.id for body in bodies),
        point.x - column["l"] * point.sin_heading,
        point.y + column["l"] * point.cos_heading,
        point.heading + column["heading"],
        column["length"],
        column["width"],
        column["radius"],
    )


def joined_bodies(one: Obstacles, other: Obstacles) -> Obstacles:
    """Return the bodies of both."""
    if not other.ids:
        return one
    names = ("x", "y", "heading", "length", "width", "radius")
    columns = (np.append(getattr(one, n), getattr(other, n)) for n in names)
    return Obstacles((*one.ids, *other.ids), *columns)
