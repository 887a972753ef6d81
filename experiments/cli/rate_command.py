"""`rearview rate`: how often something happens in a sweep."""

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.cli.user_errors import report_user_errors
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.comparison.event_rates import EventRate
    from experiments.comparison.location import Interval


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(rate)


def rate(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.")],
    *,
    event: Annotated[
        str | None,
        typer.Option(help="Condition on a row, as SQL.  [collisions > 0]"),
    ] = None,
    weight: Annotated[
        str | None,
        typer.Option(
            help="How much likelier a run is than the sweep made it, as SQL: p / q "
            "of importance sampling."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a table.")
    ] = False,
) -> None:
    """Estimate how often an event happens to each planner, with 95 % intervals.

    Of a search with method subset: how probable a failure is in its space.

    Example: rearview rate sweeps/smoke --event "collisions > 0 OR min_ttc_s < 1"

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.comparison.event_rates import (
            USUAL_EVENT,
            event_rates,
            searched_probability,
        )

        searched = searched_probability(folder)
        if searched is not None:
            if event is not None or weight is not None:
                problem = "is not for a subset simulation, which has counted its own"
                raise ConfigError(f"--event, --weight: {problem}; allowed: none")
            sys.stdout.write(_probability(searched, as_json=as_json))
            return
        event = USUAL_EVENT if event is None else event
        found = event_rates(folder, event, weight)
        if as_json:
            sys.stdout.write(json.dumps([_as_json(one) for one in found]) + "\n")
        else:
            sys.stdout.write(f"{event}\n" + "".join(map(_lines, found)))


def _lines(one: "EventRate") -> str:
    """Format the rate of one planner."""
    kept = one.runs - one.lost
    text = f"{one.label}: {one.events} of {kept} runs"
    if one.lost:
        text += f" ({one.lost} more without a result)"
    if one.broken:
        text += f"; in {one.broken} of the runs planner or simulator failed on the way"
    text += f"\n  per run       {_interval(one.share)}\n"
    if one.per_1000_km is not None:
        text += f"  per 1,000 km  {_interval(one.per_1000_km)}"
        text += f"   ({one.distance:,.1f} km driven)\n"
    if one.effective < kept - 0.5:
        text += f"  effective sample size {one.effective:.0f} of {kept}\n"
    return text


def _probability(value: "Interval", *, as_json: bool) -> str:
    """Format the probability of a failure that was searched."""
    if as_json:
        return json.dumps({"per_run": [value.value, value.low, value.high]}) + "\n"
    from experiments.sweep.search.files import probability_words

    words = probability_words(value.value, value.low, value.high)
    return f"failures\n  per run       {words}\n"


def _interval(value: "Interval") -> str:
    """Format an estimate with its interval."""
    if math.isnan(value.value):
        return "unknown: no run has a result"
    return f"{value.value:.3g}   95 %: {value.low:.3g} to {value.high:.3g}"


def _as_json(one: "EventRate") -> dict[str, Any]:
    """Return a rate as plain data."""

    def plain(value: "Interval | None") -> list[float] | None:
        return None if value is None else [value.value, value.low, value.high]

    return {
        "label": one.label,
        "runs": one.runs,
        "lost": one.lost,
        "broken": one.broken,
        "events": one.events,
        "per_run": plain(one.share),
        "per_1000_km": plain(one.per_1000_km),
        "effective_size": one.effective,
        "distance_km": one.distance,
    }
