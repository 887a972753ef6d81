"""How far the ego was from its plans, and what it believed from what was there."""

import numpy as np

from experiments.trace.schema import Column, Table, Trace
from planner.states import FloatArray

NEAR = 30.0  # within which a vehicle should be believed in [m]
_A_DIFFERENCE = 2  # values that it takes


def _present(trace: Trace, key: str) -> FloatArray | None:
    """Return a column of the tracking; None with a perfect plant."""
    values: FloatArray = np.ma.getdata(trace.tracking[key])
    return values if values.size else None


def max_error(trace: Trace, key: str) -> float | None:
    """Return the largest magnitude of a tracking error; None with a perfect plant."""
    values = _present(trace, key)
    return None if values is None else float(np.abs(values).max())


def rms_error(trace: Trace, key: str) -> float | None:
    """Return the root mean square of a tracking error; None with a perfect plant."""
    values = _present(trace, key)
    return None if values is None else float(np.sqrt(np.mean(values**2)))


def limited_share(trace: Trace) -> float | None:
    """Return the share of time at a limit of steering, drive or grip."""
    values = _present(trace, "limited")
    return None if values is None else float(values.mean())


def rms_command_jerk(trace: Trace) -> float | None:
    """Return the root mean square of the change of the drive command [m/s³]."""
    commands = _present(trace, "drive_command_mps2")
    if commands is None or commands.size < _A_DIFFERENCE:
        return None
    step = float(trace.fact("step_s"))
    return float(np.sqrt(np.mean((np.diff(commands) / step) ** 2)))


def plans_anew(trace: Trace) -> int | None:
    """Count the plans that began off the last one; None with a perfect plant."""
    if _present(trace, "limited") is None:
        return None
    return int(np.count_nonzero(trace.starts["rule"] == "anew"))


def nearest_error(trace: Trace) -> float | None:
    """Return the mean error of the position of the nearest vehicle believed in [m].

    In each step the vehicle that is nearest to the ego's rear axle among those that
    are both there and believed in. None with perfect eyes, or without such a vehicle.
    """
    found = nearest_errors(trace)
    there = found[np.isfinite(found)]
    return float(np.mean(there)) if there.size else None


def unseen_near(trace: Trace) -> float | None:
    """Return the share of vehicles within `NEAR` that were not believed in.

    None with perfect eyes, or if no vehicle came so near.
    """
    near = missing = 0
    for ego, there, believed in _moments(trace):
        for name, place in there.items():
            if np.hypot(*(place - ego)) <= NEAR:
                near += 1
                missing += name not in believed
    return missing / near if near else None


def unseen(trace: Trace, reach: float) -> dict[str, list[int]]:
    """Return in which rows of the steps a vehicle within `reach` was not believed in.

    By vehicle, in the order in which they were first missed.
    """
    found: dict[str, list[int]] = {}
    for row, (ego, there, believed) in enumerate(_moments(trace)):
        for name, place in there.items():
            if name not in believed and np.hypot(*(place - ego)) <= reach:
                found.setdefault(name, []).append(row)
    return found


def nearest_errors(trace: Trace) -> FloatArray:
    """Compute the error of the nearest vehicle that is believed in, (n_steps,) [m].

    NaN in steps without one, and in all with perfect eyes.
    """
    errors = np.full(len(trace.steps["index"]), np.nan)
    for row, (ego, there, believed) in enumerate(_moments(trace)):
        both = there.keys() & believed.keys()
        if both:
            name = min(
                both, key=lambda one: (float(np.hypot(*(there[one] - ego))), one)
            )
            errors[row] = float(np.hypot(*(there[name] - believed[name])))
    return errors


def tracked(trace: Trace, key: str) -> FloatArray:
    """Return a column of the tracking in every step, (n_steps,); NaN without one."""
    values = np.full(len(trace.steps["index"]), np.nan)
    rows = np.searchsorted(trace.steps["index"], trace.tracking["index"])
    values[rows] = np.ma.getdata(trace.tracking[key])
    return values


_Places = dict[str, FloatArray]


def _moments(trace: Trace) -> list[tuple[FloatArray, _Places, _Places]]:
    """List the ego, the vehicles there and those believed in, of steps with any."""
    if not len(trace.perceived["index"]):
        return []
    steps = trace.steps
    egos = np.column_stack([np.ma.getdata(steps[k]) for k in ("x_m", "y_m")])
    there, believed = (
        _places(trace.vehicles, steps["index"]),
        _places(trace.perceived, steps["index"]),
    )
    return list(zip(egos, there, believed, strict=True))


def _places(table: Table, steps: Column) -> list[_Places]:
    """Return the positions of each step's vehicles by name."""
    index = table["index"]
    points = np.column_stack([np.ma.getdata(table[k]) for k in ("x_m", "y_m")])
    ids = table["id"]
    first, last = np.searchsorted(index, steps), np.searchsorted(index, steps, "right")
    return [
        dict(zip(ids[a:b].tolist(), points[a:b], strict=True))
        for a, b in zip(first.tolist(), last.tolist(), strict=True)
    ]
