"""The field of obstacles in the frame of the road, and the ego's cover by discs.

Everything in this package happens over s: obstacles are discs (s, l, r_ob), the road
is a pair of bounds and a curvature, all known along s. Distances are those of the
plane: on a road of constant curvature they are exact, see `squared_distance`.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planner.errors import InvalidInputError
from planner.numerics.compiled import inlined
from planner.reference_path.path import ReferencePath
from planner.scene import Obstacles, Scene
from planner.states import BoolArray, FloatArray, freeze
from planner.vehicle import Vehicle

SAMPLE_STEP = 1.0  # between road samples taken from a scene [m]
DISC_EXCESS = 0.3  # of discs beyond the sides of a body too long for three [m]
MAX_PIECES = 40  # that one rectangle is cut into


class ObstacleColumns(NamedTuple):
    """Obstacles as compiled code takes them; arrays are (n_obstacles,)."""

    s: FloatArray  # [m]
    l: FloatArray  # [m]
    radius: FloatArray  # r_ob [m]
    curvature: FloatArray  # of the road there [1/m]


class RoadColumns(NamedTuple):
    """Samples of the road as compiled code takes them; arrays are (m,)."""

    s: FloatArray  # strictly growing [m]
    left: FloatArray  # [m]
    right: FloatArray  # [m]
    curvature: FloatArray  # [1/m]


class Discs(NamedTuple):
    """The ego's discs as compiled code takes them."""

    offset: FloatArray  # from the ego's point, rear first, (n_discs,) [m]
    radius: float  # with any margin [m]
    half_length: float  # of the piece of the body in each [m]
    half_width: float  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class FrenetObstacles:
    """Static obstacles and the road in Frenet coordinates.

    Obstacle columns are (n,), in the order of s; road columns are (m,), linear between
    samples and held beyond the ends. The body has to stay in right <= l <= left.
    """

    s: FloatArray  # obstacle centres [m]
    l: FloatArray  # [m]
    radius: FloatArray  # r_ob, of the disc about the obstacle [m]
    road_s: FloatArray  # strictly growing [m]
    left: FloatArray  # [m]
    right: FloatArray  # [m]
    curvature: FloatArray  # of the reference path, positive to the left [1/m]
    ids: tuple[str, ...] = ()  # of the obstacles, where they have names

    def __post_init__(self) -> None:
        """Copy, check and freeze the columns; bring the obstacles into order."""
        order = np.lexsort((np.asarray(self.l), np.asarray(self.s)))
        if self.ids:
            named = tuple(self.ids[i] for i in order.tolist())
            object.__setattr__(self, "ids", named)
        for name in ("s", "l", "radius"):
            column = freeze(np.asarray(getattr(self, name))[order])
            object.__setattr__(self, name, column)
        for name in ("road_s", "left", "right", "curvature"):
            column = freeze(getattr(self, name))
            if column.shape != np.shape(self.road_s):
                raise InvalidInputError(f"{name} has shape {column.shape}")
            object.__setattr__(self, name, column)
        if not self.road_s.size or (self.road_s[1:] <= self.road_s[:-1]).any():
            raise InvalidInputError("road_s must be one or more strictly growing s")

    @property
    def n_obstacles(self) -> int:
        """Number of obstacles."""
        return int(self.s.size)

    def road_at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (left, right, curvature) at arc lengths `s` [m], in the shape of s."""
        return (
            np.interp(s, self.road_s, self.left),
            np.interp(s, self.road_s, self.right),
            np.interp(s, self.road_s, self.curvature),
        )

    def obstacle_columns(self) -> ObstacleColumns:
        """Return the obstacles with the road's curvature at each."""
        curvature = np.interp(self.s, self.road_s, self.curvature)
        return ObstacleColumns(self.s, self.l, self.radius, curvature)

    def road_columns(self) -> RoadColumns:
        """Return the samples of the road."""
        return RoadColumns(self.road_s, self.left, self.right, self.curvature)

    def only(self, keep: BoolArray) -> "FrenetObstacles":
        """Keep the obstacles marked in `keep`, (n,)."""
        named = zip(self.ids, keep.tolist(), strict=False)
        return FrenetObstacles(
            self.s[keep],
            self.l[keep],
            self.radius[keep],
            self.road_s,
            self.left,
            self.right,
            self.curvature,
            tuple(name for name, kept in named if kept),
        )


@dataclass(frozen=True, slots=True)
class Cover:
    """Discs of one radius that cover the ego, their centres along its heading."""

    offsets: tuple[float, ...]  # from the ego's point, rear first [m]
    radius: float  # r_ev [m]
    half_length: float  # of the piece of the body that one disc covers [m]
    half_width: float  # as half_length; the pieces have to stay on the road [m]

    @classmethod
    def single(cls, radius: float) -> "Cover":
        """Make the printed cover: one disc about the ego's point; [Thesis] fig. 5.3.

        The road then binds the point only, as on the ±5 m of [Thesis] table 5.1.
        """
        return cls((0.0,), radius, 0.0, 0.0)

    @classmethod
    def of(cls, vehicle: Vehicle, margin: float = 0.0) -> "Cover":
        """Cover the vehicle's rectangle: by three discs, or as many as it is long for.

        Three about a lorry of 12 m would be 1.1 m wider than it on either side.

        Args:
            vehicle: To be covered.
            margin: Kept to the road's edges on either side [m].
        """
        return _cover_of(vehicle, margin)

    def discs(self, margin: float = 0.0) -> Discs:
        """Return the discs, grown by a margin [m]."""
        radius = self.radius + margin
        return Discs(np.array(self.offsets), radius, self.half_length, self.half_width)


@lru_cache(maxsize=16)
def _cover_of(vehicle: Vehicle, margin: float) -> Cover:
    """Make the cover of `Cover.of`; every cycle asks for the same ones."""
    centres, radius = vehicle.disc_cover(DISC_EXCESS)
    piece = vehicle.length / (2.0 * centres.size)
    width = 0.5 * vehicle.width + margin
    return Cover(tuple(centres.tolist()), radius, piece, width)


def straight_field(
    obstacles: FloatArray, half_width: float, s_end: float
) -> FrenetObstacles:
    """Make a field on a straight road.

    Args:
        obstacles: (s, l, r_ob) in rows, (n, 3) [m].
        half_width: The road is -half_width ... half_width [m].
        s_end: The road goes from 0 to here [m].
    """
    rows = np.asarray(obstacles, dtype=np.float64).reshape(-1, 3)
    both = np.ones(2)
    return FrenetObstacles(
        rows[:, 0],
        rows[:, 1],
        rows[:, 2],
        np.array([0.0, s_end]),
        half_width * both,
        -half_width * both,
        0.0 * both,
    )


def field_of(scene: Scene, horizon: float) -> FrenetObstacles:
    """Project the scene's static obstacles into the frame of its road.

    A disc is itself. A rectangle becomes a row of discs along its longer side, each
    about one piece of it and grown by its own radius: one disc about a long one would
    close a road that is open beside it.

    Args:
        scene: Of this cycle.
        horizon: Obstacles that begin farther ahead are left out [m].

    Returns:
        Obstacles from behind the ego's rear on; the road from there to the horizon.
    """
    ego = scene.ego_frenet
    ids, s, l, reach = _along(scene.path, scene.obstacles)
    start = ego.s - scene.vehicle.length
    road_s = np.arange(start, ego.s + horizon + scene.vehicle.length, SAMPLE_STEP)
    left, right = scene.road.at(road_s)
    curvature = scene.path.at(road_s).curvature
    near = ((s + reach > start) & (s - reach < ego.s + horizon)).nonzero()[0]
    named = tuple(ids[i] for i in near.tolist())
    columns = s[near], l[near], reach[near], road_s, left, right, curvature
    return FrenetObstacles(*columns, named)


# Both are the same in every cycle of an episode, and are told apart as objects.
@lru_cache(maxsize=4)
def _along(
    path: ReferencePath, fixed: Obstacles
) -> tuple[tuple[str, ...], FloatArray, FloatArray, FloatArray]:
    """Project the discs of obstacles: (ids, s, l, radius), the last three (n,) [m]."""
    ids, x, y, reach = pieces(fixed)
    s, l = path.project(x, y)
    return ids, s, l, reach


def pieces(
    fixed: Obstacles,
) -> tuple[tuple[str, ...], FloatArray, FloatArray, FloatArray]:
    """Cover obstacles by discs: (ids, x, y, radius), the last three (n_discs,) [m]."""
    longer = np.maximum(fixed.length, fixed.width)
    shorter = np.minimum(fixed.length, fixed.width)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(shorter > 0.0, np.ceil(longer / shorter), 1.0)
    count = np.clip(parts, 1.0, MAX_PIECES).astype(np.int64)
    if np.all(count == 1):
        radius = 0.5 * np.hypot(fixed.length, fixed.width) + fixed.radius
        return fixed.ids, fixed.x, fixed.y, radius
    of = np.repeat(np.arange(count.size), count)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    place = (np.arange(of.size) - first[of] + 0.5) / count[of] - 0.5
    turned = fixed.heading + np.where(fixed.length >= fixed.width, 0.0, np.pi / 2.0)
    along = place * longer[of]
    radius = 0.5 * np.hypot(longer / count, shorter) + fixed.radius
    return (
        tuple(fixed.ids[i] for i in of.tolist()),
        fixed.x[of] + along * np.cos(turned[of]),
        fixed.y[of] + along * np.sin(turned[of]),
        radius[of],
    )


@inlined
def squared_chord(along: float, curvature: float) -> float:
    """Square of the chord over a piece of a circle [m²].

    (2 sin(k ds / 2) / k)² with the sine to third order, 5e-4 short at k ds = 1. The
    series falls beyond k² ds² = 6, and below zero from 12 on: what is more than that
    far around a bend would be at the ego's place. It is held up there.

    Args:
        along: ds, of either sign [m].
        curvature: k [1/m].
    """
    turned = curvature * along
    return float(along * along * (1.0 - min(turned * turned, 6.0) / 12.0))


@inlined
def squared_distance(
    s: float, l: float, other_s: float, other_l: float, curvature: float
) -> float:
    """Square of the distance in the plane between two Frenet points [m²].

    On a circle of curvature k it is (l1 - l2)² + rho1 rho2 (2 sin(k ds / 2) / k)² with
    rho = 1 - k l; see `squared_chord`.

    Args:
        s: Of one point [m].
        l: Of one point [m].
        other_s: Of the other [m].
        other_l: Of the other [m].
        curvature: Of the reference path between them [1/m].
    """
    along, across = s - other_s, l - other_l
    stretch = (1.0 - curvature * l) * (1.0 - curvature * other_l)
    chord2 = squared_chord(along, curvature)
    return float(across * across + max(stretch, 0.0) * chord2)


@inlined
def disc_centre(
    s: float, l: float, slope: float, offset: float, curvature: float
) -> tuple[float, float]:
    """Frenet place of a disc `offset` ahead of the ego's point, along its heading.

    Exact on a straight, to second order in offset * curvature on a circle.

    Args:
        s: Of the ego's point [m].
        l: Of the ego's point [m].
        slope: dl/ds of the path there [-].
        offset: Along the heading [m].
        curvature: Of the reference path [1/m].

    Returns:
        (s, l) of the disc's centre [m].
    """
    rho = 1.0 - curvature * l
    norm = np.sqrt(rho * rho + slope * slope)
    along, across = offset * rho / norm, offset * slope / norm
    ahead = along / (rho - curvature * across)
    ahead *= 1.0 - (curvature * ahead) ** 2 / 3.0
    return s + ahead, l + across - 0.5 * curvature * along * along / rho


@inlined
def half_span(
    discs: Discs, slope: float, rho: float, turned: float, curvature: float
) -> float:
    """How far the piece of the body in a disc reaches across the road from its centre.

    The road has turned under the body by the time it reaches the disc: a long body that
    follows a bend stands across it at its front.

    Args:
        discs: Of the ego.
        slope: dl/ds of the path at the ego's point [-].
        rho: 1 - kappa_r l there [-].
        turned: What the road has turned on the way to the disc [rad].
        curvature: Of the road between [1/m].

    Returns:
        Half of its width across the road [m].
    """
    norm = np.sqrt(rho * rho + slope * slope)
    cos, sin = rho / norm, slope / norm
    across = abs(sin - turned * cos)
    along = min(cos + turned * sin, 1.0)
    need = discs.half_length * across + discs.half_width * along
    return float(need + 0.5 * abs(curvature) * discs.half_length**2)


@inlined
def path_curvature(
    l: float, slope: float, second: float, curvature: float, curvature_rate: float
) -> float:
    """Curvature in the plane of a path l(s); [Thesis] eq. 3.45 as corrected [1/m].

    Args:
        l: [m].
        slope: dl/ds [-].
        second: d²l/ds² [1/m].
        curvature: Of the reference path [1/m].
        curvature_rate: Its derivative along s [1/m²].
    """
    rho = 1.0 - curvature * l
    tan = slope / rho
    cos = 1.0 / np.sqrt(1.0 + tan * tan)
    bend = second + (curvature_rate * l + curvature * slope) * tan
    return float((bend * cos * cos / rho + curvature) * cos / rho)
