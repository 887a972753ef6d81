"""`rearview events`: what happened in a run, and when."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.cli.user_errors import report_user_errors

if TYPE_CHECKING:
    from experiments.metrics.events import Event
    from experiments.trace.schema import Trace


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(events)


def events(
    run: Annotated[
        Path | None,
        typer.Argument(metavar="RUN", help="Run folder.  [newest run in runs]"),
    ] = None,
    *,
    as_json: Annotated[
        bool, typer.Option("--json", help="One line of JSON for each event.")
    ] = False,
) -> None:
    """List what happened in a run: contacts, braking, lane lines, signals, ...

    Example: rearview events runs/some --json

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.episode.newest_run import newest_run
        from experiments.metrics.events import events as found_in
        from experiments.storage.atomic_folder import require_there
        from experiments.trace.files import read_trace

        folder = run or newest_run()
        require_there(folder)
        trace = read_trace(folder)
        for event in found_in(trace):
            facts = event_facts(event, trace)
            if as_json:
                sys.stdout.write(json.dumps(facts, ensure_ascii=False) + "\n")
            else:
                sys.stdout.write(f"{facts['time_s']:8.1f} s  {event.text}\n")


def event_facts(event: "Event", trace: "Trace") -> dict[str, Any]:
    """Return an event as plain data: times since the ego entered, its place."""
    time, s = trace.steps["time_s"], trace.steps["s_m"]
    place = s[event.step]
    return {
        "event": str(event.kind),
        "gravity": str(event.gravity),
        "time_s": round(float(time[event.step]), 6),
        "until_s": None if event.until is None else round(float(time[event.until]), 6),
        "step": int(trace.steps["index"][event.step]),
        "s_m": None if str(place) == "--" else round(float(place), 3),
        "subject": event.subject or None,
        "value": event.value,
        "unit": event.unit or None,
        "text": event.text,
    }
