"""Metrics of the rules at junctions and signals."""

import json
from collections.abc import Mapping

import numpy as np

from experiments.trace.schema import Trace
from planner.states import BoolArray, FloatArray

OVERSHOOT = 0.35  # a bumper that stops this far over a line has stopped at it [m]
HARD = 2.0  # a driver with the right of way who brakes harder is hindered [m/s²]
REACTION = 1.0  # nobody brakes earlier than after so long for a zone [s]
STANDING = 0.1  # slower is standing [m/s]
NEVER = np.inf
ON_FOOT = "person:"  # how the names of people on foot begin


def line_violations(trace: Trace) -> int:
    """Count the closed stop lines that the front bumper has driven over."""
    return len(passed_lines(trace))


def passed_lines(trace: Trace) -> list[int]:
    """List the rows of the steps in which a closed line was driven over."""
    steps, fronts = trace.steps, _fronts(trace)
    found = []
    for k in range(len(fronts) - 1):
        over = np.array(json.loads(steps["stop_lines"][k])) + OVERSHOOT
        count = np.count_nonzero((fronts[k] <= over) & (fronts[k + 1] > over))
        found += [k + 1] * int(count)
    return found


def encroachments(trace: Trace) -> int | None:
    """Count the vehicles with the right of way that had to brake for the ego.

    One counts if, before the conflict zone, it brakes by `HARD` more than its own turn
    asks for while the ego is over its line and has not left the zone. One that is
    farther from the zone than it takes to stop before it with `HARD` brakes for
    somebody else, and an ego that stands before the zone waits. None without a
    junction.
    """
    found = hindered(trace)
    return None if found is None else len(found)


def hindered(trace: Trace) -> dict[str, int] | None:
    """Return the vehicles that `encroachments` counts, each with its first row."""
    if not trace.junctions["index"].size:
        return None
    table, braking = trace.foes, _accelerations(trace)
    index, step = table["index"], float(trace.fact("step_s"))
    front, rear = _fronts(trace)[index], _rears(trace)[index]
    line = _lines_of_foes(trace)
    inside = (
        (front > line + OVERSHOOT) & (rear < table["end_m"]) & (table["entry_m"] > 0.0)
    )
    first = (table["goes_first"] == 1) & (table["gives_way"] == 0)
    stands = np.abs(np.ma.filled(trace.steps["speed_mps"], 0.0))[index] < STANDING
    waits = stands & (front < table["begin_m"])
    met = inside & first & ~waits & (table["held"] == 0)
    found: dict[str, int] = {}
    for row in np.flatnonzero(met).tolist():
        k, name = int(index[row]), str(table["vehicle"][row])
        acceleration = braking.get((k, name), 0.0)
        before = float(table["speed_mps"][row]) - acceleration * step
        if acceleration < -HARD - _own_braking(table, row, before):
            found.setdefault(name, k)
    return found


def people_hindered(trace: Trace) -> int | None:
    """Count the people on foot with the right of way who stand before the ego's way.

    At a crossing or on it, while the ego is over the crossing, whoever else they stand
    for. None without a junction.
    """
    found = hindered_people(trace)
    return None if found is None else len(found)


def hindered_people(trace: Trace) -> dict[str, int] | None:
    """Return the people that `people_hindered` counts, each with the first row."""
    if not trace.junctions["index"].size:
        return None
    table = trace.foes
    index = table["index"]
    front, rear = _fronts(trace)[index], _rears(trace)[index]
    over = (front > table["begin_m"]) & (rear < table["end_m"])
    first = (table["goes_first"] == 1) & (table["gives_way"] == 0)
    stands = (table["speed_mps"] < STANDING) & (table["entry_m"] > 0.0)
    met = over & first & stands & (table["held"] == 0)
    found: dict[str, int] = {}
    for row in np.flatnonzero(met).tolist():
        name = str(table["vehicle"][row])
        if name.startswith(ON_FOOT):
            found.setdefault(name, int(index[row]))
    return found


def _own_braking(table: Mapping[str, FloatArray], row: int, speed: float) -> float:
    """Return how hard a vehicle brakes for another reason than the ego [m/s²].

    Args:
        table: Of foes.
        row: In it.
        speed: Before it braked in this step [m/s].

    Returns:
        What its turn asks for; inf if it is too far from the zone.
    """
    if table["entry_m"][row] > speed**2 / (2.0 * HARD) + speed * REACTION:
        return np.inf
    slower = max(speed**2 - float(table["turn_speed_mps"][row]) ** 2, 0.0)
    return slower / (2.0 * max(float(table["to_line_m"][row]), 1.0))


def gave_way_time(trace: Trace) -> float | None:
    """Return how long the ego stood to give way [s]; None without a junction."""
    if not trace.junctions["index"].size:
        return None
    return float(np.count_nonzero(gives_way(trace)) * trace.fact("step_s"))


def gives_way(trace: Trace) -> BoolArray:
    """Mark the steps in which the ego stands to give way, (n_steps,)."""
    waits = ~np.ma.getmaskarray(trace.steps["gives_way_to"])
    stands = np.abs(np.ma.getdata(trace.steps["speed_mps"])) < STANDING
    return np.asarray(waits & stands)


def post_encroachment_time(trace: Trace) -> float | None:
    """Return the least time between one leaving a conflict zone and the other's coming.

    Null unless the ego and another vehicle have both passed a zone of the same
    foe while the ego was near the junction.
    """
    found = closest_passage(trace)
    return None if found is None else found[0]


def closest_passage(trace: Trace) -> tuple[float, int] | None:
    """Return the time of `post_encroachment_time` [s] and the row of its step.

    The step is the one in which the second of the two enters the zone.
    """
    table = trace.foes
    if not table["index"].size:
        return None
    fronts, rears = _fronts(trace), _rears(trace)
    step = float(trace.fact("step_s"))
    least, moment = NEVER, 0
    keys = list(zip(table["vehicle"].tolist(), table["begin_m"].tolist(), strict=True))
    for key in dict.fromkeys(keys):
        rows = np.array([each == key for each in keys])
        own = _passage(fronts > key[1], rears > table["end_m"][rows][0])
        other = _visit(table["index"][rows], table["entry_m"][rows], len(fronts))
        if own is None or other is None:
            continue
        apart = max(own[0] - other[1], other[0] - own[1], 0) * step
        if apart < least:
            least, moment = apart, max(own[0], other[0])
    return None if least == NEVER else (float(least), moment)


def _passage(entered: BoolArray, left: BoolArray) -> tuple[int, int] | None:
    """Return the steps in which the ego entered and left a zone."""
    if not (entered.any() and left.any()):
        return None
    return int(np.argmax(entered)), int(np.argmax(left))


def _visit(index: FloatArray, entry: FloatArray, n: int) -> tuple[int, int] | None:
    """Return the steps in which another vehicle entered and left a zone.

    Its rows end when it has left; one that is there to the end has not.
    """
    within = index[entry <= 0.0]
    if not within.size or index[-1] >= n - 1:
        return None
    return int(within[0]), int(index[-1]) + 1


def _fronts(trace: Trace) -> FloatArray:
    """Return the arc length of the ego's front bumper in each step [m]."""
    reach = trace.fact("length_m") - trace.fact("rear_overhang_m")
    return np.asarray(np.ma.filled(trace.steps["s_m"], np.nan) + reach)


def _rears(trace: Trace) -> FloatArray:
    """Return the arc length of the ego's rear bumper in each step [m]."""
    overhang = trace.fact("rear_overhang_m")
    return np.asarray(np.ma.filled(trace.steps["s_m"], np.nan) - overhang)


def _accelerations(trace: Trace) -> dict[tuple[int, str], float]:
    """Return the acceleration of each vehicle in each step [m/s²]."""
    table = trace.vehicles
    return dict(
        zip(
            zip(table["index"].tolist(), table["id"].tolist(), strict=True),
            np.ma.filled(table["acceleration_mps2"], 0.0).tolist(),
            strict=True,
        )
    )


def _lines_of_foes(trace: Trace) -> FloatArray:
    """Return the ego's stop line of each foe, (n_foes,) [m]."""
    table, junctions = trace.foes, trace.junctions
    first = np.searchsorted(junctions["index"], table["index"])
    return np.asarray(junctions["stop_m"][first + table["junction"]])
