"""How often something happens: per run and per 1,000 km, also from weighted samples.

Sources: Wilson, JASA 22 (1927) 209. Garwood, Biometrika 28 (1936) 437. Fay and Feuer,
Statist. Med. 16 (1997) 791. Kish, Survey Sampling (1965), for the effective size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from experiments.comparison.inference import wilson
from experiments.comparison.location import CONFIDENCE, Interval
from experiments.comparison.results import rows
from experiments.config.search import SUBSET
from experiments.cosim.records import EpisodeStatus
from experiments.errors import ConfigError
from experiments.metrics import columns
from experiments.storage.json_files import read_json
from experiments.sweep.search.files import ASKED, FOUND, PROBABILITY, STOPS
from planner.states import FloatArray

USUAL_EVENT = "collisions > 0"
PER_KM = 1000.0  # kilometres that a rate is given for
M_PER_KM = 1000.0
_LOST = "failure IS NOT NULL"
_FAILED = (EpisodeStatus.PLANNER_FAILED, EpisodeStatus.SIMULATOR_FAILED)
_BROKEN = f"status IN ({', '.join(repr(str(one)) for one in _FAILED)})"


@dataclass(frozen=True, slots=True)
class EventRate:
    """How often an event happened to one planner."""

    label: str
    runs: int
    lost: int  # of them, without a result: part of no rate
    broken: int  # with a result up to where the planner or the simulator failed
    events: int
    share: Interval  # of the runs
    effective: float  # runs that an unweighted sample would need [-]
    distance: float  # driven [km]
    per_1000_km: Interval | None  # None where weights or no distance forbid it


def weighted_rate(
    weights: FloatArray, occurred: Sequence[bool], confidence: float = CONFIDENCE
) -> Interval:
    """Estimate a probability from samples of another distribution.

    The estimate is sum(w 1) / n, unbiased for w = p / q; the interval is that of a
    weighted sum of Poisson counts (Fay and Feuer 1997), where the event that may have
    been missed weighs as much as the heaviest that was seen; if none was, as the
    heaviest run.

    Args:
        weights: How much likelier each sample is than it was drawn, (n,), not negative.
        occurred: Whether the event occurred, (n,).
        confidence: Of the interval.
    """
    largest = float(weights.max(initial=0.0))
    if largest == 0.0:
        return Interval(0.0, 0.0, 0.0)
    scale = largest / len(weights)  # everything below is in units of it
    hit = weights[np.asarray(occurred, dtype=bool)] / largest
    tail = (1.0 - confidence) / 2.0
    rate, variance = float(hit.sum()), float((hit**2).sum())
    low = _gamma_quantile(tail, rate, variance)
    more = float(hit.max(initial=0.0)) or 1.0  # weight of the event that may be missing
    high = _gamma_quantile(1.0 - tail, rate + more, variance + more**2)
    return Interval(scale * rate, scale * low, scale * high)


def _gamma_quantile(share: float, mean: float, variance: float) -> float:
    """Return a quantile of the gamma distribution; 0 without a variance."""
    if variance == 0.0:
        return 0.0
    return float(stats.gamma.ppf(share, mean**2 / variance, scale=variance / mean))


def poisson_rate(
    events: int, exposure: float, confidence: float = CONFIDENCE
) -> Interval:
    """Estimate events per unit of exposure with the exact interval (Garwood 1936).

    Args:
        events: Counted.
        exposure: Above 0, for example in 1,000 km.
        confidence: Of the interval.
    """
    tail = (1.0 - confidence) / 2.0
    low = stats.chi2.ppf(tail, 2.0 * events) / 2.0 if events else 0.0
    high = stats.chi2.ppf(1.0 - tail, 2.0 * events + 2.0) / 2.0
    return Interval(events / exposure, float(low) / exposure, float(high) / exposure)


def effective_size(weights: FloatArray) -> float:
    """Return the size of an equally good sample without weights (Kish 1965).

    It is (sum w)^2 / sum w^2.
    """
    largest = float(weights.max(initial=0.0))
    if largest == 0.0:
        return 0.0
    scaled = weights / largest
    return float(scaled.sum()) ** 2 / float((scaled**2).sum())


def event_rates(
    folder: Path, event: str = USUAL_EVENT, weight: str | None = None
) -> list[EventRate]:
    """Estimate how often an event happens to each planner of a sweep.

    Args:
        folder: Of the sweep.
        event: Condition on a row, as SQL.
        weight: How much likelier each run is than the sweep has made it, as an SQL
            expression; None: the runs' own `importance_weight` where they have one,
            else all count the same.

    Raises:
        ConfigError: If SQL cannot understand one of them, a weight is no number, or
            the folder is of a search whose trials are no sample.
    """
    sampled = sample_of(folder)
    if weight is None and _has_weights(folder):
        weight = f"coalesce({columns.IMPORTANCE_WEIGHT}, 1.0)"
    expression = "1.0" if weight is None else weight
    _require_condition(folder, event)
    if not expression.strip():
        raise ConfigError("--weight: is empty; allowed: a number of each run, as SQL")
    rows(folder, f"SELECT max(({expression})::DOUBLE) FROM runs", "--weight")
    found = rows(
        folder,
        f"SELECT label, {_LOST} AS lost, {_BROKEN} AS broken, "
        f"coalesce(({event}), false) AS event, "
        f"({expression})::DOUBLE AS weight, coalesce(distance_m, 0.0) AS distance_m "
        "FROM runs ORDER BY label, run_id",
    )
    if sampled is not None:  # of a search, without the runs that were not drawn
        kept = rows(folder, "SELECT run_id FROM runs ORDER BY label, run_id")
        is_drawn = [row["run_id"] in sampled for row in kept]
        found = [row for row, drawn in zip(found, is_drawn, strict=True) if drawn]
    labels = sorted({str(row["label"]) for row in found})
    return [
        _rate(label, [r for r in found if r["label"] == label], weighted=bool(weight))
        for label in labels
    ]


def sample_of(folder: Path) -> frozenset[str] | None:
    """Return the runs of a search that are a sample of its space; None of a sweep.

    Raises:
        ConfigError: If the folder is of a search whose trials were not drawn at random,
            or whose number follows from what they found.
    """
    if not (folder / ASKED).is_file():
        return None
    method = read_json(folder / ASKED).get("method")
    if method != "random":
        raise ConfigError(
            f"{folder}: was searched with {method}: its trials are no sample; allowed: "
            "a sweep, or a search with method random or subset"
        )
    if not (folder / FOUND).is_file():
        problem = "is a search that is not finished"
        raise ConfigError(f"{folder}: {problem}; allowed: a finished one")
    found = read_json(folder / FOUND)
    trials, enough = found["trials"], found.get(STOPS)
    if enough is not None and len(trials) < found["budget"]:
        raise ConfigError(
            f"{folder}: {STOPS}: ended the search after {len(trials)} of "
            f"{found['budget']} trials: their share of failures is too high; allowed: "
            "a search that its budget ended"
        )
    return frozenset(str(trial["run_id"]) for trial in trials)


def searched_probability(folder: Path) -> Interval | None:
    """Return the probability of a failure that a subset simulation has estimated.

    None of other folders.

    Raises:
        ConfigError: If the search is not finished.
    """
    if not (folder / ASKED).is_file():
        return None
    if read_json(folder / ASKED).get("method") != SUBSET:
        return None
    if not (folder / FOUND).is_file():
        problem = "is a search that is not finished"
        raise ConfigError(f"{folder}: {problem}; allowed: a finished one")
    found = read_json(folder / FOUND)[PROBABILITY]
    return Interval(found["probability"], found["low"], found["high"])


def _require_condition(folder: Path, event: str) -> None:
    """Reject an event that is not true or false of each run."""
    wanted = f"allowed: a condition, such as {USUAL_EVENT}"
    if not event.strip():
        raise ConfigError(f"--event: is empty; {wanted}")
    asked = f"SELECT DISTINCT typeof(({event})) AS kind FROM runs"
    if any(row["kind"] != "BOOLEAN" for row in rows(folder, asked, "--event")):
        raise ConfigError(f"--event: {event} is neither true nor false; {wanted}")


def _has_weights(folder: Path) -> bool:
    """Check whether runs carry weights of their own."""
    asked = f"SELECT count({columns.IMPORTANCE_WEIGHT}) AS n FROM runs"
    return bool(rows(folder, asked)[0]["n"])


def _rate(label: str, runs: list[dict[str, object]], *, weighted: bool) -> EventRate:
    """Estimate the rate of one planner."""
    kept = [row for row in runs if not row["lost"]]
    weights = np.array([_number(row["weight"]) for row in kept])
    occurred = [bool(row["event"]) for row in kept]
    allowed = "allowed: 0 or more, above 0 in some"
    if not np.isfinite(weights).all():
        raise ConfigError(f"--weight: is not a number in some runs; {allowed}")
    if (weights < 0.0).any():
        raise ConfigError(f"--weight: is {weights.min():g} in a run; {allowed}")
    if kept and not weights.any():
        raise ConfigError(f"--weight: is 0 in all runs of {label}; {allowed}")
    events = sum(occurred)
    distance = sum(_number(row["distance_m"]) for row in kept) / M_PER_KM
    if not kept:
        share = Interval(float("nan"), 0.0, 1.0)
    elif weighted:
        share = weighted_rate(weights, occurred)
    else:
        share = wilson(events, len(kept))
    per_km = None
    if distance > 0.0 and not weighted:
        per_km = poisson_rate(events, distance / PER_KM)
    size = effective_size(weights)
    lost = len(runs) - len(kept)
    broken = sum(bool(row["broken"]) for row in kept)
    return EventRate(
        label, len(runs), lost, broken, events, share, size, distance, per_km
    )


def _number(value: object) -> float:
    """Return a value of a row as a number, NaN for nothing."""
    return float(value) if isinstance(value, int | float) else float("nan")
