"""Distance and contact of oriented rectangles grown by a radius.

A body is a rectangle about (x, y) along its heading, grown by `radius` on all sides: a
disc has length = width = 0, a plain rectangle radius = 0.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled, inlined
from planner.states import FloatArray, freeze

CONTACT_TOLERANCE = 1e-3  # [m]; a swept approach closer than this is a contact

# Columns of the packed table.
X, Y, HEADING, HALF_LENGTH, HALF_WIDTH, RADIUS = range(6)


@dataclass(frozen=True, slots=True)
class Rectangle:
    """One body."""

    x: float  # centre [m]
    y: float  # [m]
    heading: float  # [rad]
    length: float  # [m]
    width: float  # [m]
    radius: float = 0.0  # [m]

    def __post_init__(self) -> None:
        """Refuse numbers that make no rectangle."""
        _require_bodies(self.row)

    @property
    def row(self) -> FloatArray:
        """The body as a row of the packed table."""
        return freeze(
            (
                self.x,
                self.y,
                self.heading,
                0.5 * self.length,
                0.5 * self.width,
                self.radius,
            )
        )


@dataclass(frozen=True, slots=True, eq=False)
class Rectangles:
    """Many bodies; all arrays are (n,)."""

    x: FloatArray  # centre [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    length: FloatArray  # [m]
    width: FloatArray
    radius: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        for field in fields(self):
            array = freeze(getattr(self, field.name))
            if array.shape != np.shape(self.x) or array.ndim != 1:
                raise InvalidInputError(
                    f"{field.name} has shape {array.shape}, x {np.shape(self.x)}"
                )
            object.__setattr__(self, field.name, array)
        _require_bodies(self.rows)

    @property
    def rows(self) -> FloatArray:
        """The bodies as rows of the packed table, (n, 6)."""
        columns = (
            self.x,
            self.y,
            self.heading,
            0.5 * self.length,
            0.5 * self.width,
            self.radius,
        )
        return freeze(np.stack(columns, axis=1))


def distance(a: Rectangle, b: Rectangle) -> float:
    """Return the distance of two bodies [m], 0 where they overlap."""
    return _rounded_distance(a.row, b.row)


def distances(one: Rectangle, many: Rectangles) -> FloatArray:
    """Return the distance of one body from each of many, (n,) [m]."""
    return _distances(one.row, many.rows)


def swept_contacts(
    one_before: Rectangle,
    one_after: Rectangle,
    many_before: Rectangles,
    many_after: Rectangles,
) -> NDArray[np.bool_]:
    """Return which bodies touch one body at any time during a step.

    Public API; the compiled `swept_contact` is what a loop over steps calls.

    Positions are linear in time, headings turn the shorter way. Conservative
    advancement: time goes on by the distance over a bound of the relative speed, so
    that no pass through a thin or fast body is missed. An approach closer than
    `CONTACT_TOLERANCE` counts as a contact.

    Args:
        one_before: The body at the start of the step.
        one_after: The same body at its end.
        many_before: (n,) bodies at the start.
        many_after: The same bodies, in the same order, at its end.

    Returns:
        (n,) contacts.

    Raises:
        InvalidInputError: If the numbers of bodies differ.
    """
    if many_before.x.shape != many_after.x.shape:
        raise InvalidInputError(
            f"{many_before.x.size} bodies before, {many_after.x.size} after the step"
        )
    return _swept_contacts(
        one_before.row, one_after.row, many_before.rows, many_after.rows
    )


def corners(bodies: Rectangle | Rectangles) -> FloatArray:
    """Return the corners without the radius, (..., 4, 2), clockwise from front left."""
    rows = bodies.row if isinstance(bodies, Rectangle) else bodies.rows
    cos, sin = np.cos(rows[..., HEADING]), np.sin(rows[..., HEADING])
    along = rows[..., HALF_LENGTH, None] * np.array([1.0, 1.0, -1.0, -1.0])
    across = rows[..., HALF_WIDTH, None] * np.array([1.0, -1.0, -1.0, 1.0])
    x = rows[..., X, None] + along * cos[..., None] - across * sin[..., None]
    y = rows[..., Y, None] + along * sin[..., None] + across * cos[..., None]
    return np.stack([x, y], axis=-1)


def _require_bodies(rows: FloatArray) -> None:
    """Raise unless all numbers are finite and no dimension is negative."""
    if not np.isfinite(rows).all():
        raise InvalidInputError(f"a body must be finite, got {rows}")
    if np.any(rows[..., HALF_LENGTH:] < 0.0):
        raise InvalidInputError(f"length, width, radius must be >= 0, got {rows}")


@inlined
def _outside_box(dx: float, dy: float, half_length: float, half_width: float) -> float:
    """Return the squared distance of a point from an upright box about the origin."""
    ex = max(abs(dx) - half_length, 0.0)
    ey = max(abs(dy) - half_width, 0.0)
    return ex * ex + ey * ey


@inlined
def _nearest_corner(
    dx: float,
    dy: float,
    cos: float,
    sin: float,
    half_length: float,
    half_width: float,
    box_half_length: float,
    box_half_width: float,
) -> float:
    """Return the least squared distance of the corners from an upright box."""
    ax, ay = half_length * cos, half_length * sin
    bx, by = -half_width * sin, half_width * cos
    return min(
        _outside_box(dx + ax + bx, dy + ay + by, box_half_length, box_half_width),
        _outside_box(dx + ax - bx, dy + ay - by, box_half_length, box_half_width),
        _outside_box(dx - ax + bx, dy - ay + by, box_half_length, box_half_width),
        _outside_box(dx - ax - bx, dy - ay - by, box_half_length, box_half_width),
    )


@inlined
def core_distance(
    dx: float,
    dy: float,
    a_heading: float,
    a_half_length: float,
    a_half_width: float,
    b_heading: float,
    b_half_length: float,
    b_half_width: float,
) -> float:
    """Return the distance of two plain rectangles, b at (dx, dy) from a [m].

    Overlap by separating axes; apart, the nearest points of two convex polygons
    include a corner of one of them.
    """
    a_cos, a_sin = np.cos(a_heading), np.sin(a_heading)
    cos, sin = np.cos(b_heading - a_heading), np.sin(b_heading - a_heading)
    # b's centre in the frame of a, and a's centre in the frame of b
    along, across = dx * a_cos + dy * a_sin, dy * a_cos - dx * a_sin
    back_along, back_across = -along * cos - across * sin, along * sin - across * cos
    c, s = abs(cos), abs(sin)
    if (
        abs(along) <= a_half_length + b_half_length * c + b_half_width * s
        and abs(across) <= a_half_width + b_half_length * s + b_half_width * c
        and abs(back_along) <= b_half_length + a_half_length * c + a_half_width * s
        and abs(back_across) <= b_half_width + a_half_length * s + a_half_width * c
    ):
        return 0.0
    squared = min(
        _nearest_corner(
            along,
            across,
            cos,
            sin,
            b_half_length,
            b_half_width,
            a_half_length,
            a_half_width,
        ),
        _nearest_corner(
            back_along,
            back_across,
            cos,
            -sin,
            a_half_length,
            a_half_width,
            b_half_length,
            b_half_width,
        ),
    )
    return float(np.sqrt(squared))


@inlined
def _rounded_distance(a: FloatArray, b: FloatArray) -> float:
    """Return the distance of two rows of the packed table [m]."""
    core = core_distance(
        b[X] - a[X],
        b[Y] - a[Y],
        a[HEADING],
        a[HALF_LENGTH],
        a[HALF_WIDTH],
        b[HEADING],
        b[HALF_LENGTH],
        b[HALF_WIDTH],
    )
    return float(max(core - a[RADIUS] - b[RADIUS], 0.0))


@compiled
def _distances(one: FloatArray, many: FloatArray) -> FloatArray:
    """Return the distance of one row from each of many."""
    out = np.empty(many.shape[0])
    for i in range(many.shape[0]):
        out[i] = _rounded_distance(one, many[i])
    return out


@inlined
def _turn(before: float, after: float) -> float:
    """Return the shorter turn between two headings [rad]."""
    full = 2.0 * np.pi
    return (after - before + np.pi) % full - np.pi


@inlined
def swept_contact(
    a_before: FloatArray, a_after: FloatArray, b_before: FloatArray, b_after: FloatArray
) -> bool:
    """Check whether two moving rows of the packed table touch; see `swept_contacts`."""
    dx, dy = b_before[X] - a_before[X], b_before[Y] - a_before[Y]
    travel_x = b_after[X] - a_after[X] - dx
    travel_y = b_after[Y] - a_after[Y] - dy
    a_turn = _turn(a_before[HEADING], a_after[HEADING])
    b_turn = _turn(b_before[HEADING], b_after[HEADING])
    # no point of a rectangle moves faster than its centre plus turn * half diagonal
    travel = (
        np.hypot(travel_x, travel_y)
        + abs(a_turn) * np.hypot(a_before[HALF_LENGTH], a_before[HALF_WIDTH])
        + abs(b_turn) * np.hypot(b_before[HALF_LENGTH], b_before[HALF_WIDTH])
    )
    grown = a_before[RADIUS] + b_before[RADIUS]
    time = 0.0
    while True:
        core = core_distance(
            dx + time * travel_x,
            dy + time * travel_y,
            a_before[HEADING] + time * a_turn,
            a_before[HALF_LENGTH],
            a_before[HALF_WIDTH],
            b_before[HEADING] + time * b_turn,
            b_before[HALF_LENGTH],
            b_before[HALF_WIDTH],
        )
        gap = core - grown
        if gap <= CONTACT_TOLERANCE:
            return True
        if not gap <= (1.0 - time) * travel + CONTACT_TOLERANCE:
            return False
        time = min(time + gap / travel, 1.0)


@compiled
def _swept_contacts(
    a_before: FloatArray, a_after: FloatArray, b_before: FloatArray, b_after: FloatArray
) -> NDArray[np.bool_]:
    """Sweep one row against many."""
    out = np.empty(b_before.shape[0], dtype=np.bool_)
    for i in range(b_before.shape[0]):
        out[i] = swept_contact(a_before, a_after, b_before[i], b_after[i])
    return out
