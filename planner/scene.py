"""What a planner sees in one cycle."""

from dataclasses import dataclass, field

import numpy as np

from planner.errors import InvalidInputError
from planner.reference_path.path import ReferencePath
from planner.states import CartesianState, FloatArray, FrenetState, freeze
from planner.vehicle import Vehicle


def _freeze_columns(record: object, names: tuple[str, ...], shape: object) -> None:
    """Copy the named columns to float64, check their shape, make them read-only."""
    for name in names:
        array = freeze(getattr(record, name))
        if array.shape != shape:
            raise InvalidInputError(f"{name} has shape {array.shape}, not {shape}")
        object.__setattr__(record, name, array)


@dataclass(frozen=True, slots=True, eq=False)
class RoadBounds:
    """Lateral room of the ego's carriageway along its reference path.

    Between samples the bounds are linear, beyond the ends they are held. All arrays
    are (n,); the body has to stay in right <= l <= left.
    """

    s: FloatArray  # strictly growing [m]
    left: FloatArray  # [m]
    right: FloatArray  # [m]

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        shape = np.shape(self.s)
        _freeze_columns(self, ("s", "left", "right"), shape)
        if len(shape) != 1 or shape[0] < 1 or np.any(np.diff(self.s) <= 0.0):
            raise InvalidInputError("s of the road bounds must grow strictly")
        if np.any(self.left <= self.right):
            raise InvalidInputError("left bounds must exceed right bounds")

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give (left, right) at arc lengths `s` [m], in the shape of `s`."""
        return np.interp(s, self.s, self.left), np.interp(s, self.s, self.right)


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """Lanes of the ego's carriageway along its reference path, right to left.

    Between samples offsets and widths are linear, beyond the ends they are held. A
    lane that exists only in part has a zero width elsewhere.
    """

    s: FloatArray  # strictly growing, (n,) [m]
    centre: FloatArray  # lateral offsets of the lane centres, (n_lanes, n) [m]
    width: FloatArray  # (n_lanes, n) [m]

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        shape = np.shape(self.s)
        _freeze_columns(self, ("s",), shape)
        _freeze_columns(self, ("centre", "width"), (len(self.centre), *shape))
        if len(shape) != 1 or np.any(np.diff(self.s) <= 0.0):
            raise InvalidInputError("s of the lanes must grow strictly")
        if np.any(np.diff(self.centre, axis=0) <= 0.0):
            raise InvalidInputError("lane centres must go from right to left")

    @classmethod
    def none(cls) -> "Lanes":
        """Make a road without marked lanes."""
        return cls(np.zeros(1), np.empty((0, 1)), np.empty((0, 1)))

    def at(self, s: float) -> tuple[FloatArray, FloatArray]:
        """Give (centres, widths) at arc length `s`, (n_lanes,) each [m]."""
        centres = np.array([np.interp(s, self.s, row) for row in self.centre])
        widths = np.array([np.interp(s, self.s, row) for row in self.width])
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

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        names = ("x", "y", "heading", "length", "width", "radius")
        _freeze_columns(self, names, (len(self.ids),))

    @classmethod
    def none(cls) -> "Obstacles":
        """Make the empty set."""
        empty = np.empty(0)
        return cls((), empty, empty, empty, empty, empty, empty)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Where vehicles will be; arrays are (n, n_steps), column k at k * step.

    (s, l) are the centre's Frenet coordinates on the ego's reference path; where a
    vehicle has none, s is inf and l is 0: it is then never ahead or behind.
    """

    step: float  # [s]
    x: FloatArray
    y: FloatArray
    heading: FloatArray
    s: FloatArray
    l: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        shape = np.shape(self.x)
        if len(shape) != 2:
            raise InvalidInputError(f"predictions must be (n, n_steps), not {shape}")
        _freeze_columns(self, ("x", "y", "heading", "s", "l"), shape)


@dataclass(frozen=True, slots=True, eq=False)
class Vehicles:
    """Other road users; arrays are (n,), (x, y) is the centre of the rectangle."""

    ids: tuple[str, ...]
    x: FloatArray  # [m]
    y: FloatArray
    heading: FloatArray  # [rad]
    speed: FloatArray  # [m/s]
    acceleration: FloatArray  # [m/s²]
    length: FloatArray  # [m]
    width: FloatArray
    prediction: Prediction

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        names = ("x", "y", "heading", "speed", "acceleration", "length", "width")
        _freeze_columns(self, names, (len(self.ids),))
        if self.prediction.x.shape[0] != len(self.ids):
            raise InvalidInputError(
                f"{self.prediction.x.shape[0]} predictions for {len(self.ids)} vehicles"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Everything that one planning cycle may know."""

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
    target_speed: float  # [m/s]
    lanes: Lanes = field(default_factory=Lanes.none)
