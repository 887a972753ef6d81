"""The columns of runs with many egos: each for all vehicles, egos, SUMO's drivers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.metrics import traffic_flow
from experiments.metrics.columns import Cell
from experiments.metrics.metric import Better, CellKind, Metric
from experiments.metrics.traffic_flow import FleetMeasurement
from experiments.trace.fleet import is_ego
from planner.states import BoolArray

EGOS_DRIVEN = "egos_driven"

Measure = Callable[[FleetMeasurement, BoolArray], float | None]
TO_MS = 1e3  # from seconds


@dataclass(frozen=True, slots=True)
class _Measure:
    """A metric of a set of vehicles."""

    name: str
    label: str
    compute: Measure
    formula: str
    unit: str = ""
    digits: int = 2
    better: Better = Better.LOWER


_MEASURES = (
    _Measure(
        "mean_speed_mps",
        "mean speed",
        traffic_flow.mean_speed,
        "distance of all vehicles over their time",
        "m/s",
        better=Better.HIGHER,
    ),
    _Measure(
        "speed_deviation_mps",
        "speed deviation",
        traffic_flow.speed_deviation,
        "standard deviation of the speeds over vehicles and time",
        "m/s",
    ),
    _Measure(
        "delay_s_per_km",
        "delay",
        traffic_flow.delay,
        "Σ max(1 - v/v_wished, 0) Δt over the distance; v_wished: what the limit, the "
        "driver SUMO gave the vehicle, and the vehicle allow",
        "s/km",
    ),
    _Measure(
        "stops_per_km",
        "stops",
        traffic_flow.stops,
        "times that a vehicle that had driven 2 m/s fell below 0.3 m/s, per distance",
        "1/km",
    ),
    _Measure(
        "hard_brakings_per_km",
        "hard brakings",
        traffic_flow.hard_brakings,
        "times that braking became harder than 3 m/s², per distance",
        "1/km",
    ),
    _Measure(
        "ttc_exposure",
        "time exposed to TTC < 1.5 s",
        traffic_flow.ttc_exposure,
        "share of vehicle time with less than 1.5 s to a collision with the leader",
        digits=4,
    ),
    _Measure(
        "drac_exposure",
        "time exposed to DRAC > 3.35 m/s²",
        traffic_flow.drac_exposure,
        "share of vehicle time in which Δv²/(2 gap) to the leader is above 3.35 m/s²",
        digits=4,
    ),
    _Measure(
        "string_ratio",
        "string ratio",
        traffic_flow.string_ratio,
        "median over pairs that last 20 s of the rms acceleration of the vehicle over "
        "that of its leader: above 1 disturbances grow",
    ),
    _Measure(
        "fuel_g_per_km",
        "fuel",
        traffic_flow.fuel,
        "by SUMO's emission model of the vehicle type (default HBEFA4)",
        "g/km",
        1,
    ),
    _Measure(
        "co2_g_per_km",
        "CO2",
        traffic_flow.carbon_dioxide,
        "the same",
        "g/km",
        1,
    ),
)
_SETS: Mapping[str, tuple[str, str]] = {
    "all": (", all", "of all vehicles"),
    "egos": (", egos", "of the egos"),
    "humans": (", others", "of the vehicles of SUMO's drivers"),
}
_COMPARED = (
    "all_mean_speed_mps",
    "all_delay_s_per_km",
    "all_hard_brakings_per_km",
    "all_fuel_g_per_km",
)


def _of_sets() -> tuple[Metric, ...]:
    """List every measure for every set of vehicles."""
    return tuple(
        Metric(
            column=f"{key}_{measure.name}",
            label=f"{measure.label}{words}",
            compute=lambda _: None,
            formula=f"many egos: {measure.formula}; {of}",
            unit=measure.unit,
            digits=measure.digits,
            better=measure.better,
            compared=f"{key}_{measure.name}" in _COMPARED,
        )
        for measure in _MEASURES
        for key, (words, of) in _SETS.items()
    )


FLEET_METRICS: tuple[Metric, ...] = (
    Metric(
        column=EGOS_DRIVEN,
        label="egos",
        kind=CellKind.WHOLE,
        compute=lambda _: None,
        formula="many egos: vehicles that were driven by a planner",
    ),
    Metric(
        column="egos_failed",
        label="egos handed back",
        kind=CellKind.WHOLE,
        compute=lambda _: None,
        formula="many egos: those of them that collided, left the road, stood without "
        "a way on or had no plan",
        better=Better.LOWER,
        compared=True,
    ),
    Metric(
        column="egos_share",
        label="share of egos",
        compute=lambda _: None,
        formula="many egos: distance driven by egos over that of all",
        digits=3,
    ),
    Metric(
        column="flow_veh_per_h",
        label="flow",
        compute=lambda _: None,
        formula="many egos: vehicles past the first detector per hour",
        unit="veh/h",
        better=Better.HIGHER,
        compared=True,
    ),
    Metric(
        column="detector_speed_mps",
        label="speed at the detector",
        compute=lambda _: None,
        formula="many egos: harmonic mean of the speeds at the first detector",
        unit="m/s",
        digits=2,
        better=Better.HIGHER,
    ),
    Metric(
        column="insertion_delay_s",
        label="delay before entry",
        compute=lambda _: None,
        formula="many egos: time for which vehicles wait for room to enter, per "
        "vehicle that enters",
        unit="s",
        digits=1,
        better=Better.LOWER,
    ),
    *_of_sets(),
    Metric(
        column="fleet_step_cpu_ms",
        label="CPU time of a step",
        compute=lambda _: None,
        formula="many egos: mean CPU time of a step with everything in it; real time "
        "is the step's length",
        unit="ms",
        digits=2,
        better=Better.LOWER,
        timing=True,
    ),
)


def fleet_values(found: FleetMeasurement) -> dict[str, Cell]:
    """Compute the columns of a run with many egos.

    Args:
        found: The run.

    Returns:
        Column to value, None where a measure does not apply.
    """
    trace = found.trace
    driven = traffic_flow.distance_km(found, found.counts)
    own = traffic_flow.distance_km(found, found.egos)
    rows = {"all": found.counts, "egos": found.egos, "humans": found.humans}
    cpu = TO_MS * float(trace.cpu.mean()) if trace.cpu.size else None
    values: dict[str, Cell] = {
        EGOS_DRIVEN: int(np.unique(trace.vehicle[is_ego(trace)]).size),
        "egos_failed": sum(
            how not in ("arrived", "gone") for how in trace.ego_ends["how"].tolist()
        ),
        "egos_share": own / driven if driven > 0.0 else None,
        "flow_veh_per_h": traffic_flow.flow(found),
        "detector_speed_mps": traffic_flow.detector_speed(found),
        "insertion_delay_s": traffic_flow.insertion_delay(found),
        "fleet_step_cpu_ms": cpu,
    }
    for measure in _MEASURES:
        for key in _SETS:
            values[f"{key}_{measure.name}"] = measure.compute(found, rows[key])
    return values
