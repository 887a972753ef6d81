"""The scene: the input of a planner in one cycle."""

from dataclasses import dataclass, field
from itertools import compress

import numpy as np

from planner.errors import InvalidInputError
from planner.numerics.compiled import compiled
from planner.numerics.interpolation import interpolate
from planner.reference_path.path import ReferencePath
from planner.right_of_way.records import Foe, JunctionAhead
from planner.states import (
    BoolArray,
    CartesianState,
    FloatArray,
    FrenetState,
    freeze,
    with_floats,
)
from planner.vehicle import Vehicle

OFF_ROAD_TOLERANCE = 0.01  # a body this far over the edge is still on the road [m]
# of the table of road users, in the order of its rows
COLUMNS = (
    "x",
    "y",
    "heading",
    "speed",
    "acceleration",
    "lateral_speed",
    "length",
    "width",
)
PREDICTED = ("x", "y", "heading", "s", "l")  # the same of a prediction's table


def _freeze_columns(record: object, names: tuple[str, ...], shape: object) -> None:
    """Copy the named columns to float64, check their shape, make them read-only."""
    for name in names:
        array = freeze(getattr(record, name))
        if array.shape != shape:
            raise InvalidInputError(f"{name} has shape {array.shape}, not {shape}")
        object.__setattr__(record, name, array)


def _set_layers(record: object, names: tuple[str, ...], table: FloatArray) -> None:
    """Set the table of a record and what it consists of, read-only."""
    table.setflags(write=False)
    object.__setattr__(record, "table", table)
    for name, layer in zip(names, table, strict=True):
        object.__setattr__(record, name, layer)


@dataclass(frozen=True, slots=True, eq=False)
class RoadBounds:
    """Lateral room of the ego's carriageway along its reference path.

    Between samples the bounds are linear, beyond the ends they are held. All arrays
    are (n,); the body has to stay in right <= l <= left.
    """

    s: FloatArray  # strictly growing [m]
    left: FloatArray  # [m]
    right: FloatArray  # [m]
    is_finite: bool = field(init=False, repr=False)  # left and right

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        shape = np.shape(self.s)
        _freeze_columns(self, ("s", "left", "right"), shape)
        if len(shape) != 1 or shape[0] < 1 or np.any(np.diff(self.s) <= 0.0):
            raise InvalidInputError("s of the road bounds must grow strictly")
        if np.any(self.left <= self.right):
            raise InvalidInputError("left bounds must exceed right bounds")
        finite = bool(np.isfinite((self.left, self.right)).all())
        object.__setattr__(self, "is_finite", finite)

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (left, right) at arc lengths `s` [m], in the shape of `s`."""
        return np.interp(s, self.s, self.left), np.interp(s, self.s, self.right)


@dataclass(frozen=True, slots=True, eq=False)
class SpeedLimits:
    """Speed limits along the ego's reference path; arrays are (n,).

    A limit holds from its s to the next one, the first one before it, too.
    """

    s: FloatArray  # strictly growing [m]
    limit: FloatArray  # [m/s], inf for none

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        shape = np.shape(self.s)
        _freeze_columns(self, ("s", "limit"), shape)
        if len(shape) != 1 or shape[0] < 1 or np.any(np.diff(self.s) <= 0.0):
            raise InvalidInputError("s of the speed limits must grow strictly")
        if not np.all(self.limit > 0.0):
            raise InvalidInputError("speed limits must be positive")

    @classmethod
    def none(cls) -> "SpeedLimits":
        """Return the limits of a road without any."""
        return cls(np.zeros(1), np.full(1, np.inf))

    def at(self, s: FloatArray) -> FloatArray:
        """Return the limits at arc lengths `s` [m/s], in the shape of `s`."""
        place = np.searchsorted(self.s, s, side="right") - 1
        return np.asarray(self.limit[np.maximum(place, 0)])

    def at_one(self, s: float) -> float:
        """Return the limit at one arc length [m/s]."""
        return float(self.limit[self._place(s)])

    def _place(self, s: float) -> int:
        """Return which limit holds at an arc length."""
        return max(int(self.s.searchsorted(s, side="right")) - 1, 0)

    def allowed(self, s: float, braking: float) -> float:
        """Return the speed from which every limit from `s` on can be kept.

        Args:
            s: Where it is driven [m].
            braking: With which one slows down before a lower limit [m/s²].

        Returns:
            The speed [m/s].
        """
        place = self._place(s)
        if place == self.s.size - 1 and s >= self.s[place]:
            return float(self.limit[place])  # the last one: many roads have one only
        way = np.maximum(self.s[place:] - s, 0.0)
        before = np.sqrt(self.limit[place:] ** 2 + 2.0 * braking * way)
        # the limit itself to the last bit where it holds
        return float(np.where(way > 0.0, before, self.limit[place:]).min())


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """Lanes of the ego's carriageway along its reference path, right to left.

    Between samples offsets and widths are linear, beyond the ends they are held. A
    lane that exists only in part has a zero width elsewhere.
    """

    s: FloatArray  # strictly growing, (n,) [m]
    centre: FloatArray  # lateral offsets of the lane centres, (n_lanes, n) [m]
    width: FloatArray  # (n_lanes, n) [m]
    left_hand: bool = False  # traffic keeps to the left, overtakes on the right
    # whether a lane may not be left to the left, to the right; from each sample on
    solid_left: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    solid_right: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        shape = np.shape(self.s)
        for name in ("solid_left", "solid_right"):
            given = np.array(getattr(self, name), dtype=bool)
            solid = given if given.size else np.zeros(np.shape(self.width), dtype=bool)
            solid.setflags(write=False)
            object.__setattr__(self, name, solid)
            if solid.shape != np.shape(self.width):
                raise InvalidInputError(f"{name} must have the shape of the widths")
        _freeze_columns(self, ("s",), shape)
        _freeze_columns(self, ("centre", "width"), (len(self.centre), *shape))
        if len(shape) != 1 or np.any(np.diff(self.s) <= 0.0):
            raise InvalidInputError("s of the lanes must grow strictly")
        if np.any(np.diff(self.centre, axis=0) <= 0.0):
            raise InvalidInputError("lane centres must go from right to left")

    @classmethod
    def none(cls) -> "Lanes":
        """Return the lanes of a road without markings."""
        return cls(np.zeros(1), np.empty((0, 1)), np.empty((0, 1)))

    def at(self, s: float) -> tuple[FloatArray, FloatArray]:
        """Return (centres, widths) at arc length `s`, (n_lanes,) each [m]."""
        return _lanes_at(float(s), self.s, self.centre, self.width)

    def may_change(self, lane: int, side: int, begin: float, end: float) -> bool:
        """Check whether a lane may be left all the way between two places.

        Args:
            lane: That is left.
            side: 1 to the left, -1 to the right.
            begin: [m].
            end: [m].
        """
        solid = (self.solid_left if side > 0 else self.solid_right)[lane]
        first = max(int(np.searchsorted(self.s, begin, side="right")) - 1, 0)
        last = max(int(np.searchsorted(self.s, end, side="left")), first + 1)
        return not bool(solid[first:last].any())


@compiled
def _lanes_at(
    s: float, lanes_s: FloatArray, centre: FloatArray, width: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Read centres and widths at one arc length, (n_lanes,) each."""
    n = centre.shape[0]
    here, centres, widths = np.array([s]), np.empty(n), np.empty(n)
    for lane in range(n):
        interpolate(here, 0.0, lanes_s, centre[lane], centres[lane : lane + 1])
        interpolate(here, 0.0, lanes_s, width[lane], widths[lane : lane + 1])
    return centres, widths


@dataclass(frozen=True, slots=True, eq=False)
class Obstacles:
    """Static bodies; arrays are (n,).

    A body is a rectangle of `length` x `width` about (x, y), grown by `radius` on all
    sides: a disc has length = width = 0, a plain rectangle radius = 0.
    """

    ids: tuple[str, ...]
    x: FloatArray  # centre [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    length: FloatArray  # [m]
    width: FloatArray
    radius: FloatArray
    is_finite: bool = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        names = ("x", "y", "heading", "length", "width", "radius")
        _freeze_columns(self, names, (len(self.ids),))
        columns = [getattr(self, name) for name in names]
        object.__setattr__(self, "is_finite", bool(np.isfinite(columns).all()))

    @classmethod
    def none(cls) -> "Obstacles":
        """Return the empty set."""
        empty = np.empty(0)
        return cls((), empty, empty, empty, empty, empty, empty)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Where vehicles will be; arrays are (n, n_steps), column k at k * step.

    (s, l) are the centre's Frenet coordinates on the ego's reference path; where a
    vehicle has none, s is inf and l is 0: it is then never ahead or behind. The arrays
    are the layers of one read-only table; `from_table` does not copy it.
    """

    step: float  # [s]
    x: FloatArray
    y: FloatArray
    heading: FloatArray
    s: FloatArray
    l: FloatArray
    table: FloatArray = field(init=False, repr=False)  # (5, n, n_steps)

    def __post_init__(self) -> None:
        """Copy the arrays into one table and check their shapes."""
        shape = np.shape(self.x)
        if len(shape) != 2:
            raise InvalidInputError(f"predictions must be (n, n_steps), not {shape}")
        _freeze_columns(self, PREDICTED, shape)
        table = np.array([getattr(self, name) for name in PREDICTED])
        _set_layers(self, PREDICTED, table)

    @classmethod
    def from_table(cls, step: float, table: FloatArray) -> "Prediction":
        """Make the record of a table without copying it; the table becomes read-only.

        Args:
            step: Between columns [s].
            table: Layers in the order of the fields, (5, n, n_steps).
        """
        made = object.__new__(cls)
        object.__setattr__(made, "step", step)
        _set_layers(made, PREDICTED, table)
        return made


@dataclass(frozen=True, slots=True, eq=False)
class RoadUsers:
    """Other vehicles at one moment; arrays are (n,), (x, y) the rectangle's centre.

    The arrays are the rows of one read-only table in the order of `COLUMNS`;
    `from_table` makes the record of such a table without copying it.
    """

    ids: tuple[str, ...]
    x: FloatArray  # [m]
    y: FloatArray
    heading: FloatArray  # counter-clockwise from +x [rad]
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]
    lateral_speed: FloatArray  # across the lane, positive to the vehicle's left [m/s]
    length: FloatArray  # [m]
    width: FloatArray
    table: FloatArray = field(init=False, repr=False)  # (8, n)

    def __post_init__(self) -> None:
        """Copy the arrays into one table and check their shapes."""
        _freeze_columns(self, COLUMNS, (len(self.ids),))
        table = np.array([getattr(self, name) for name in COLUMNS])
        _set_layers(self, COLUMNS, table)

    @classmethod
    def from_table(cls, ids: tuple[str, ...], table: FloatArray) -> "RoadUsers":
        """Make the record of a table without copying it; the table becomes read-only.

        Args:
            ids: Of the vehicles, (n,).
            table: Rows in the order of `COLUMNS`, (8, n).

        Raises:
            InvalidInputError: If the table has another shape.
        """
        if table.shape != (len(COLUMNS), len(ids)):
            raise InvalidInputError(f"table: {table.shape} for {len(ids)} vehicles")
        made = object.__new__(cls)
        object.__setattr__(made, "ids", ids)
        _set_layers(made, COLUMNS, np.ascontiguousarray(table, dtype=np.float64))
        return made

    def among(self, kept: BoolArray) -> "RoadUsers":
        """Return those marked in `kept`, (n,); this record itself if all are."""
        if kept.all():
            return self
        ids = tuple(compress(self.ids, kept.tolist()))
        return RoadUsers.from_table(ids, self.table.take(kept.nonzero()[0], axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class Vehicles(RoadUsers):
    """Other vehicles now, and where they are predicted to be."""

    prediction: Prediction

    def __post_init__(self) -> None:
        """Copy the arrays into one table and check their shapes."""
        RoadUsers.__post_init__(self)  # super() does not know a class with slots
        self._check_prediction()

    @classmethod
    def predicted(cls, users: RoadUsers, prediction: Prediction) -> "Vehicles":
        """Add a prediction to road users; they share their table."""
        made = object.__new__(cls)
        for name in ("ids", *COLUMNS, "table"):
            object.__setattr__(made, name, getattr(users, name))
        object.__setattr__(made, "prediction", prediction)
        made._check_prediction()
        return made

    def _check_prediction(self) -> None:
        """Raise unless there is one prediction for each vehicle."""
        if self.prediction.x.shape[0] != len(self.ids):
            raise InvalidInputError(
                f"{self.prediction.x.shape[0]} predictions for {len(self.ids)} vehicles"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The input of one planning cycle."""

    time: float  # since the ego entered [s]
    step: float  # time between planning cycles [s]
    ego: CartesianState
    ego_frenet: FrenetState
    vehicle: Vehicle
    path: ReferencePath
    road: RoadBounds
    obstacles: Obstacles
    vehicles: Vehicles
    stop_lines: tuple[float, ...]  # s that the front bumper must not pass now [m]
    target_speed: float  # [m/s], no faster than the limits here and ahead allow
    lanes: Lanes = field(default_factory=Lanes.none)
    speed_limits: SpeedLimits = field(default_factory=SpeedLimits.none)
    # junctions near the ego, and who is on the way over them; the stop lines hold what
    # follows from them for a driver who keeps to the rules
    junctions: tuple[JunctionAhead, ...] = ()
    foes: tuple[Foe, ...] = ()  # their `junction` is a place in `junctions`
    # whether PlanStats must count what each check removes; else a planner may leave
    # out what cannot change its plan
    full_statistics: bool = False

    def __post_init__(self) -> None:
        """Store whole numbers as floats: kernels would be compiled anew for them."""
        object.__setattr__(self, "ego", with_floats(self.ego))
        object.__setattr__(self, "ego_frenet", with_floats(self.ego_frenet))
        for name in ("time", "step", "target_speed"):
            object.__setattr__(self, name, float(getattr(self, name)))
