"""What a run page replays: every body in every step, plans, and what was decided."""

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.metrics.events import events
from experiments.report.run.candidates import Candidates
from experiments.report.run.curves import TimeCurve, TimeSeries, curves
from experiments.report.run.packing import Packed, pack, pack_counts, pack_exact
from experiments.report.run.road import page_obstacles, page_road, page_signals
from experiments.report.run.speed_graphs import packed_graphs
from experiments.report.run_reader import numbers
from experiments.trace.road_map import RoadMap
from experiments.trace.schema import Column, Table, Trace

PLACE, ANGLE, SPEED = 0.01, 1e-3, 0.01  # resolutions [m, rad, m/s]
ACCELERATION = 0.01  # [m/s²]
INDICATORS = ("", "right", "left", "both")  # numbers for the page
ASIDE = 1.0  # of a plan that leads to another place across the road [m]
EVERY = 2  # of the points of a plan, every second one is shown


def replay(
    trace: Trace,
    road_map: RoadMap,
    candidates: Candidates | None,
    graphs: Table | None = None,
) -> dict[str, Any]:
    """Gather what the page's scripts need.

    Args:
        trace: With at least one step.
        road_map: About it.
        candidates: Of the cycles, if they were recorded.
        graphs: s-T graphs of the cycles, if they were recorded.

    Returns:
        Plain data for JSON.
    """
    return {
        "step": float(trace.fact("step_s")),
        "time": pack_exact(numbers(trace.steps["time_s"])),
        "ego": _ego(trace),
        "ghost": _ghost(trace),
        "believed": _bodies(trace, trace.perceived)
        if len(trace.perceived["index"])
        else None,
        "vehicles": _vehicles(trace),
        "plans": _plans(trace),
        "cycles": _cycles(trace),
        "counts_candidates": bool(np.ma.filled(trace.steps["candidates"], 0).any()),
        "road": page_road(trace, road_map),
        "obstacles": page_obstacles(trace.obstacles),
        "signals": page_signals(trace),
        "events": page_events(trace),
        "curves": [_curve(curve, trace) for curve in curves(trace)],
        "candidates": None if candidates is None else candidates.packed(trace),
        "graphs": None if graphs is None else packed_graphs(graphs, trace),
    }


def page_events(trace: Trace) -> list[dict[str, Any]]:
    """Return the events as the page lists and marks them."""
    time = numbers(trace.steps["time_s"])
    return [
        {
            "kind": str(event.kind),
            "gravity": str(event.gravity),
            "step": event.step,
            "until": event.until,
            "time": round(float(time[event.step]), 6),
            "text": event.text,
        }
        for event in events(trace)
    ]


def _ego(trace: Trace) -> dict[str, Any]:
    """Return the centre of the ego's rectangle in each step."""
    steps = trace.steps
    heading = numbers(steps["heading_rad"])
    offset = trace.fact("length_m") / 2.0 - trace.fact("rear_overhang_m")
    return {
        "length": float(trace.fact("length_m")),
        "width": float(trace.fact("width_m")),
        "x": pack(numbers(steps["x_m"]) + offset * np.cos(heading), PLACE),
        "y": pack(numbers(steps["y_m"]) + offset * np.sin(heading), PLACE),
        "heading": pack(np.unwrap(heading), ANGLE),
        "speed": pack(numbers(steps["speed_mps"]), SPEED),
        "acceleration": pack(numbers(steps["acceleration_mps2"]), ACCELERATION),
        "s": pack(numbers(steps["s_m"]), PLACE),
        "contacts": _texts(_contacts(steps["contacts"])),
        "indicator": pack_counts(_planned_side(trace)),
    }


def _planned_side(trace: Trace) -> NDArray[np.int64]:
    """Return to which side each plan leads, (n_steps,): places in `INDICATORS`.

    The ego of a plan that ends more than `ASIDE` beside where the ego is would indicate
    it to others.
    """
    plans, steps = trace.plans, trace.steps
    first = starts(trace, plans)
    sides = np.zeros(len(steps["index"]), dtype=np.int64)
    planned = np.flatnonzero(np.diff(first))
    aside = (
        numbers(plans["l_m"])[first[planned + 1] - 1] - numbers(steps["l_m"])[planned]
    )
    sides[planned] = np.select(
        [aside > ASIDE, aside < -ASIDE],
        [INDICATORS.index("left"), INDICATORS.index("right")],
    )
    return sides


def _ghost(trace: Trace) -> dict[str, Packed]:
    """Return the centre of the ghost in each step, NaN without one."""
    return {
        "x": pack(numbers(trace.steps["ghost_x_m"]), PLACE),
        "y": pack(numbers(trace.steps["ghost_y_m"]), PLACE),
        "heading": pack(numbers(trace.steps["ghost_heading_rad"]), ANGLE),
    }


def _vehicles(trace: Trace) -> dict[str, Any]:
    """Pack all vehicles, step by step."""
    table = trace.vehicles
    kinds, indicators = _looks(trace, table)
    found = _bodies(trace, table)
    return {
        **found,
        "kinds": [kinds.get(name, "") for name in found["ids"]],
        "indicator": pack_counts(indicators),
        "speed": pack(numbers(table["speed_mps"]), SPEED),
        "acceleration": pack(numbers(table["acceleration_mps2"]), ACCELERATION),
    }


def _bodies(trace: Trace, table: Table) -> dict[str, Any]:
    """Pack the rectangles of a table, step by step."""
    ids, codes = np.unique(np.asarray(table["id"], dtype=str), return_inverse=True)
    resolutions = {
        "x": ("x_m", PLACE),
        "y": ("y_m", PLACE),
        "heading": ("heading_rad", ANGLE),
        "length": ("length_m", PLACE),
        "width": ("width_m", PLACE),
    }
    return {
        "ids": ids.tolist(),
        "start": pack_counts(starts(trace, table)),
        "id": pack_counts(codes),
        **{
            key: pack(numbers(table[name]), resolution)
            for key, (name, resolution) in resolutions.items()
        },
    }


def _looks(trace: Trace, table: Table) -> tuple[dict[str, str], NDArray[np.int64]]:
    """Return the kind of each vehicle, and the indicators of each row of a table."""
    looks = trace.looks
    kinds = dict(zip(looks["id"].tolist(), looks["kind"].tolist(), strict=True))
    shown: dict[str, list[tuple[int, int]]] = {}  # index from which on -> indicator
    for index, name, side in zip(
        looks["index"].tolist(), looks["id"], looks["indicator"], strict=True
    ):
        code = INDICATORS.index(side) if side in INDICATORS else 0
        shown.setdefault(name, []).append((index, code))
    indicators = np.zeros(len(table["index"]), dtype=np.int64)
    index, names = np.ma.getdata(table["index"]), table["id"]
    for name, changes in shown.items():
        if not any(code for _, code in changes):
            continue
        rows = np.flatnonzero(names == name)
        since = np.searchsorted([at for at, _ in changes], index[rows], "right") - 1
        codes = np.array([code for _, code in changes])
        indicators[rows] = np.where(since >= 0, codes[since], 0)
    return kinds, indicators


def _plans(trace: Trace) -> dict[str, Packed]:
    """Pack the planned positions, step by step, thinned."""
    table = trace.plans
    k = numbers(table["k"])
    last = np.append(k[1:] <= k[:-1], True) if k.size else np.empty(0, dtype=bool)
    kept = (k % EVERY == 0) | last
    thin = {key: values[kept] for key, values in table.items()}
    return {
        "start": pack_counts(starts(trace, thin)),
        "x": pack(numbers(thin["x_m"]), PLACE),
        "y": pack(numbers(thin["y_m"]), PLACE),
    }


def starts(trace: Trace, table: Table) -> NDArray[np.intp]:
    """Return where the rows of each step begin in a table, (n_steps + 1,)."""
    index = trace.steps["index"]
    ends = np.append(index, index[-1] + 1)
    return np.searchsorted(np.ma.getdata(table["index"]), ends)


def _cycles(trace: Trace) -> dict[str, Any]:
    """Return status, counts and costs that the planner reported in each cycle."""
    steps = trace.steps
    return {
        "status": _texts(steps["plan_status"]),
        "reason": _texts(_why(steps)),
        "blocker": _texts(steps["blocker"]),
        "nearest": _texts(steps["nearest"]),
        "removed": _texts(steps["removed"]),
        "costs": _texts(_shortened(steps["costs"])),
        "candidates": pack_counts(np.ma.filled(steps["candidates"], 0)),
        "survivors": pack_counts(np.ma.filled(steps["survivors"], 0)),
    }


def _why(steps: Table) -> Column:
    """Return the reason of each cycle, or the planner's note on its choice."""
    reason = np.ma.filled(steps["reason"], "").astype(str)
    said = np.ma.filled(steps["explanation"], "").astype(str)
    return np.where(reason != "", reason, said)


def _texts(column: Column) -> dict[str, Any]:
    """Write a column of texts as codes into a list of different ones."""
    values = np.ma.filled(column, "").astype(str)
    different, codes = np.unique(values, return_inverse=True)
    return {"texts": different.tolist(), "codes": pack_counts(codes)}


def _contacts(column: Column) -> Column:
    """Write the ids that were touched one after the other."""
    return np.array([", ".join(json.loads(cell)) for cell in column], dtype=object)


def _shortened(column: Column) -> Column:
    """Round the costs: four digits can be read."""
    cells = np.ma.filled(column, "").tolist()
    short = [
        json.dumps(
            {
                k: float(f"{v:.4g}") if math.isfinite(v) else None
                for k, v in json.loads(cell).items()
            }
        )
        if cell
        else ""
        for cell in cells
    ]
    return np.array(short, dtype=object)


def _curve(curve: TimeCurve, trace: Trace) -> dict[str, Any]:
    """Pack one curve."""
    return {
        "title": curve.title,
        "unit": curve.unit,
        "digits": curve.digits,
        "note": curve.note,
        "words": curve.words(numbers(trace.steps["time_s"])),
        "low": curve.low,
        "high": curve.high,
        "series": [
            {
                "name": series.name,
                "style": series.style,
                "values": pack(series.values, _resolution(series)),
            }
            for series in curve.series
        ],
    }


def _resolution(series: TimeSeries) -> float:
    """A thousandth of the range: less than a pixel."""
    there = series.values[np.isfinite(series.values)]
    return float(np.ptp(there)) / 1000.0 if there.size else 1.0
