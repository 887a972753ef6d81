"""Progress of an episode: a bar on a terminal, plain lines elsewhere; on stderr."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from experiments.config import Scenario
from experiments.cosim.fleet.records import FleetStep
from experiments.cosim.records import StepRecord

LINE_INTERVAL = 10.0  # between plain lines [s]
BAR_INTERVAL = 0.2  # between updates of the bar [s]

OnStep = Callable[[StepRecord | FleetStep], None]


@contextmanager
def progress(scenario: Scenario) -> Iterator[OnStep]:
    """Display the progress of an episode.

    Yields:
        What takes every step.
    """
    if sys.stderr.isatty():
        with _bar(scenario) as on_step:
            yield on_step
    else:
        yield _lines(scenario)


@contextmanager
def _bar(scenario: Scenario) -> Iterator[OnStep]:
    """Display a bar."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    last = 0.0
    begin = 0.0
    total: float | None = scenario.simulation.duration_s
    if scenario.single_ego is not None:
        begin = scenario.single_ego.start_m
        total = (scenario.single_ego.goal - begin) or None
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[now]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(scenario.name, total=total, now="warming up")

        def on_step(record: StepRecord | FleetStep) -> None:
            nonlocal last
            now = monotonic()
            if now - last < BAR_INTERVAL:
                return
            last = now
            done = _done(record) - begin
            shown.update(task, completed=max(done, 0.0), now=_words(record))

        yield on_step


def _lines(scenario: Scenario) -> OnStep:
    """Write a line every `LINE_INTERVAL` seconds."""
    last = monotonic()

    def on_step(record: StepRecord | FleetStep) -> None:
        nonlocal last
        now = monotonic()
        if now - last < LINE_INTERVAL:
            return
        last = now
        sys.stderr.write(f"{scenario.name}: {_words(record)}\n")
        sys.stderr.flush()

    return on_step


def _done(record: StepRecord | FleetStep) -> float:
    """Return how far a run is: along the road [m], or in time [s]."""
    if isinstance(record, FleetStep):
        return record.time
    return record.ego_frenet.s if record.ego_frenet else 0.0


def _words(record: StepRecord | FleetStep) -> str:
    """Format time, position and speed of the ego, or how many egos there are."""
    if isinstance(record, FleetStep):
        n = len(record.snapshot.users.ids)
        return f"t = {record.time:.1f} s, {len(record.egos)} egos of {n} vehicles"
    s = "" if record.ego_frenet is None else f"s = {record.ego_frenet.s:.0f} m, "
    return f"t = {record.time:.1f} s, {s}v = {record.ego.speed:.1f} m/s"
