"""States and trajectories: the shape and unit contract of the package.

SI units and radians. Heading is counter-clockwise from +x; the lateral offset l is
positive to the left of the reference path. The ego's point is the centre of its rear
axle. Arrays are float64 and read-only, time on the last axis.
"""

from dataclasses import dataclass, fields
from functools import cache
from numbers import Real
from operator import attrgetter
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner.errors import InvalidInputError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

State = TypeVar("State", "CartesianState", "FrenetState")
Record = TypeVar("Record")
_NUMBER_KINDS = "fiubO"  # of NumPy's types; objects may be numbers
FLOAT = np.dtype(np.float64)  # a type given as such is found sooner than by its class


def freeze(values: ArrayLike) -> FloatArray:
    """Copy `values` into a read-only float64 array, row by row.

    Kernels are compiled for each order of the elements that they come across.
    """
    array = np.array(values, dtype=FLOAT, order="C")
    array.setflags(write=False)
    return array


def read_only(array: FloatArray) -> FloatArray:
    """Return a read-only view."""
    view = array.view()
    view.flags.writeable = False
    return view


def store_floats(record: object) -> None:
    """Turn the whole numbers in a dataclass's fields of type float into floats.

    A kernel is compiled once more, for minutes, if an int comes where it was a float.

    Args:
        record: Frozen; called from its `__post_init__`.
    """
    kind: Any = type(record)
    for name in _names_of_floats(kind):
        value = getattr(record, name)
        if type(value) is float:
            continue
        stored = tuple(map(_as_float, value)) if isinstance(value, tuple) else value
        object.__setattr__(record, name, _as_float(stored))


@cache
def _names_of_floats(kind: type) -> tuple[str, ...]:
    """Return the fields of a dataclass that hold floats, or may."""
    return tuple(
        field.name
        for field in fields(kind)
        if float in (field.type, *get_args(field.type))
    )


def _as_float(value: object) -> object:
    """Return a number as a float, anything else as it is."""
    if isinstance(value, bool):
        return value
    return float(value) if isinstance(value, Real) else value


@dataclass(frozen=True, slots=True)
class CartesianState:
    """One state of the ego in the plane."""

    x: float  # [m]
    y: float  # [m]
    heading: float  # [rad]
    curvature: float  # of the driven path, positive to the left [1/m]
    speed: float  # along the heading [m/s]
    acceleration: float  # tangential [m/s²]


@dataclass(frozen=True, slots=True)
class FrenetState:
    """One state of the ego along its reference path."""

    s: float  # arc length of the foot point [m]
    s_dot: float  # [m/s]
    s_ddot: float  # [m/s²]
    l: float  # [m]
    l_dot: float  # [m/s]
    l_ddot: float  # [m/s²]
    l_prime: float  # dl/ds [-]
    l_second: float  # d²l/ds² [1/m]


_NUMBERS_OF = {
    kind: attrgetter(*kind.__slots__) for kind in (CartesianState, FrenetState)
}
_ONLY_FLOATS = {float}


def with_floats(state: State) -> State:
    """Return a state whose numbers are floats: itself, unless one is not."""
    read = _NUMBERS_OF.get(type(state))
    values = (
        tuple(getattr(state, field.name) for field in fields(state))
        if read is None  # of a class derived from these
        else read(state)
    )
    if set(map(type, values)) == _ONLY_FLOATS:
        return state
    if all(isinstance(value, float) for value in values):
        return state
    return type(state)(*map(float, values))


@dataclass(frozen=True, slots=True, eq=False)
class CartesianStates:
    """Many Cartesian states; all arrays have one common shape."""

    x: FloatArray
    y: FloatArray
    heading: FloatArray
    curvature: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        _freeze_fields(self)


@dataclass(frozen=True, slots=True, eq=False)
class FrenetStates:
    """Many Frenet states; all arrays have one common shape."""

    s: FloatArray
    s_dot: FloatArray
    s_ddot: FloatArray
    l: FloatArray
    l_dot: FloatArray
    l_ddot: FloatArray
    l_prime: FloatArray
    l_second: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        _freeze_fields(self)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A planned motion of the ego's rear axle; all arrays are (n_steps,).

    `t` starts at 0, the moment of planning, and grows strictly. Cartesian and Frenet
    columns describe the same points.
    """

    t: FloatArray  # [s]
    x: FloatArray
    y: FloatArray
    heading: FloatArray
    curvature: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    s: FloatArray
    l: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        _freeze_fields(self)
        _check_times(self.t)

    @classmethod
    def from_rows(cls, rows: FloatArray) -> "Trajectory":
        """Make a trajectory of a table, (9, n_steps), rows in the order of the fields.

        Raises:
            InvalidInputError: If the times do not grow.
        """
        made = _record_of(cls, rows)
        _check_times(made.t)
        return made

    @property
    def duration(self) -> float:
        """Time from the first to the last point [s]."""
        return float(self.t[-1] - self.t[0])

    def at(self, t: float) -> CartesianState:
        """Interpolate the state at time `t` [s], held at both ends.

        Points between samples are linear in time; a planner that samples at the
        simulation step never needs them.
        """
        index = int(self.t.searchsorted(t))
        if index < self.t.size and abs(self.t[index] - t) < 1e-9:
            return CartesianState(
                float(self.x[index]),
                float(self.y[index]),
                float(self.heading[index]),
                float(self.curvature[index]),
                float(self.speed[index]),
                float(self.acceleration[index]),
            )
        heading = np.interp(t, self.t, np.unwrap(self.heading))
        return CartesianState(
            float(np.interp(t, self.t, self.x)),
            float(np.interp(t, self.t, self.y)),
            float(np.arctan2(np.sin(heading), np.cos(heading))),
            float(np.interp(t, self.t, self.curvature)),
            float(np.interp(t, self.t, self.speed)),
            float(np.interp(t, self.t, self.acceleration)),
        )

    def is_finite(self) -> bool:
        """Tell whether every number of the trajectory is finite."""
        columns = [getattr(self, name) for name in self.__slots__]
        return bool(np.isfinite(columns).all())


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A planned line of the ego's rear axle, without time; all arrays are (n,).

    `distance` is the arc length of this line itself: it starts at 0, where the ego is,
    and grows strictly. Cartesian and Frenet columns describe the same points.
    """

    distance: FloatArray  # [m]
    x: FloatArray
    y: FloatArray
    heading: FloatArray
    curvature: FloatArray
    s: FloatArray  # of the foot point on the reference path [m]
    l: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        _freeze_fields(self)
        _check_distances(self.distance)

    @classmethod
    def from_rows(cls, rows: FloatArray) -> "Path":
        """Make a path of a table, (7, n), rows in the order of the fields.

        Raises:
            InvalidInputError: If the distances do not grow from 0.
        """
        made = _record_of(cls, rows)
        _check_distances(made.distance)
        return made


@dataclass(frozen=True, slots=True, eq=False)
class SpeedProfile:
    """A planned motion along a `Path`; all arrays are (n,), `jerk[-1]` is held."""

    t: FloatArray  # starts at 0, grows strictly [s]
    distance: FloatArray  # driven along the path, starts at 0 [m]
    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        _freeze_fields(self)
        _check_times(self.t)

    @classmethod
    def from_rows(cls, rows: FloatArray) -> "SpeedProfile":
        """Make a profile of a table, (5, n), rows in the order of the fields.

        Raises:
            InvalidInputError: If the times do not grow.
        """
        made = _record_of(cls, rows)
        _check_times(made.t)
        return made


def _record_of(kind: type[Record], rows: FloatArray) -> Record:
    """Make a record of the rows of a table, which is copied and read-only."""
    made = object.__new__(kind)
    frozen = _real_numbers("rows", rows)
    for name, row in zip(kind.__slots__, frozen, strict=True):  # type: ignore[attr-defined]
        object.__setattr__(made, name, row)
    return made


def _check_distances(d: FloatArray) -> None:
    """Refuse distances that do not grow from 0."""
    if d.ndim != 1 or d.size < 2 or d[0] != 0.0 or (d[1:] <= d[:-1]).any():
        raise InvalidInputError(
            "distance must be at least two strictly growing numbers from 0"
        )


def _check_times(t: FloatArray) -> None:
    """Refuse times that do not grow."""
    if t.ndim != 1 or t.size < 2 or (t[1:] <= t[:-1]).any():
        raise InvalidInputError("t must be at least two strictly growing times")


def _freeze_fields(record: object) -> None:
    """Freeze every field of an array record and check that the shapes agree."""
    names = record.__slots__  # type: ignore[attr-defined]
    arrays = [_real_numbers(name, getattr(record, name)) for name in names]
    shape = arrays[0].shape
    if any(array.shape != shape for array in arrays):
        shapes = {name: array.shape for name, array in zip(names, arrays, strict=True)}
        raise InvalidInputError(f"arrays must share one shape, got {shapes}")
    for name, array in zip(names, arrays, strict=True):
        object.__setattr__(record, name, array)


def _real_numbers(name: str, values: ArrayLike) -> FloatArray:
    """Freeze values; of texts and complex numbers NumPy would make real ones."""
    try:
        if getattr(values, "dtype", None) is not FLOAT:
            kind = np.asarray(values).dtype
            if kind.kind not in _NUMBER_KINDS:
                raise InvalidInputError(f"{name} holds {kind}; must be real numbers")
        return freeze(values)
    except (TypeError, ValueError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise InvalidInputError(f"{name} must be real numbers: {error}") from error
