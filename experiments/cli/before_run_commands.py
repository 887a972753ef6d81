"""`rearview net | check | new`: what one does before the first run."""

import sys
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.cli.scenario_options import (
    AllowPlanner,
    Overrides,
    PlannerName,
    ScenarioName,
    SeedNumber,
)
from experiments.cli.user_errors import report_user_errors
from experiments.config.counted import counted
from experiments.config.validation_errors import unknown_name
from experiments.errors import ConfigError, ResultsError

if TYPE_CHECKING:
    from experiments.config import Scenario
    from experiments.episode.preview import ScenarioPreview
    from experiments.report.figures.roads import RoutePicture
    from planner.states import FloatArray
    from sumo_nets.net_records import Edge

LISTED = 40  # edges shown unless all are asked for
SKELETONS = Path(__file__).parent / "skeletons"


class Skeleton(StrEnum):
    """Kinds of files that `new` writes."""

    SCENARIO = "scenario"
    PLANNER = "planner"
    SWEEP = "sweep"


def add_to(app: typer.Typer) -> None:
    """Add the commands to the command line."""
    app.command()(new)
    app.command()(net)
    app.command()(check)


def new(
    kind: Annotated[Skeleton, typer.Argument(help="What to write.")],
    name: Annotated[str, typer.Argument(help="Of the file, without suffix.")] = "",
) -> None:
    """Write a commented skeleton: a scenario, a planner or a sweep.

    Example: rearview new planner my_planner

    Exit status: 0 done, 2 bad input; a file that exists is left as it is.
    """
    with report_user_errors():
        stem = name or f"my_{kind}"
        if not stem.isidentifier():
            raise ConfigError(f"{stem}: is no name; allowed: letters, digits and _")
        suffix = ".py" if kind is Skeleton.PLANNER else ".yaml"
        file = Path(f"{stem}{suffix}")
        text = (SKELETONS / f"{kind}{suffix}.txt").read_text(encoding="utf-8")
        try:
            with file.open("x", encoding="utf-8") as target:
                target.write(text.replace("NAME", stem))
        except FileExistsError as error:
            raise ResultsError(
                f"{file}: is there already; allowed: a new name"
            ) from error
        sys.stdout.write(f"{file}\n")


def net(
    network: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="A .net.xml, or a shipped one.")
    ],
    *,
    everything: Annotated[
        bool, typer.Option("--all", help=f"More than the {LISTED} longest edges.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Picture: .png, .svg or .pdf."),
    ] = None,
) -> None:
    """List the edges of a SUMO network: lanes, lengths, limits, signals, next edges.

    Example: rearview net my.net.xml -o net.png

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.report.figures.save import require_picture
        from experiments.trace.road_map import whole_map
        from sumo_nets.build import net_path
        from sumo_nets.catalogue import networks
        from sumo_nets.net_reader import read_net

        shipped = networks()
        file = net_path(network) if network in shipped else Path(network)
        if not file.exists() and file.suffix != ".xml":
            raise ConfigError(
                f"{network}: is neither a network file nor a shipped network; "
                f"{unknown_name(network, list(shipped))}"
            )
        if output is not None:
            require_picture(output)
        found = read_net(file)
        roads = [edge for edge in found.roads if edge.drivable_lanes]
        roads.sort(key=lambda edge: -edge.drivable_lanes[0].length)
        signals = {
            link.signal for edge in roads for lane in edge.lanes for link in lane.links
        }
        ends = {"internal", "dead_end"}  # kinds of nodes where no roads meet
        nodes = found.junctions.values()
        meeting = sum(junction.kind not in ends for junction in nodes)
        side = "left" if found.left_hand else "right"
        sys.stdout.write(
            f"{found.file}: {counted(len(roads), 'edge')} for cars, "
            f"{counted(meeting, 'junction')}, "
            f"{counted(len(signals - {''}), 'signal')}, "
            f"traffic on the {side}\n"
        )
        _print_edges(roads if everything else roads[:LISTED])
        if len(roads) > LISTED and not everything:
            sys.stdout.write(f"and {len(roads) - LISTED} shorter ones: --all\n")
        if output is not None:
            from experiments.report.figures.roads import draw_network
            from experiments.report.figures.save import save_picture

            road_map = whole_map(found)
            sys.stdout.write(
                f"{save_picture('net', output, lambda: draw_network(road_map))}\n"
            )


def _print_edges(edges: "list[Edge]") -> None:
    """Print a table of edges."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for name in ("edge", "lanes", "length [m]", "limit [m/s]", "signal", "next edges"):
        table.add_column(name, justify="right" if "[" in name else "left")
    for edge in edges:
        links = [link for lane in edge.drivable_lanes for link in lane.links]
        ahead = dict.fromkeys(
            link.target.edge.id for link in links if link.target.drivable
        )
        lane = edge.drivable_lanes[0]
        table.add_row(
            edge.id,
            str(len(edge.drivable_lanes)),
            f"{lane.length:.1f}",
            f"{lane.speed:.2f}",
            " ".join(dict.fromkeys(link.signal for link in links if link.signal)),
            " ".join(ahead),
        )
    width = None if sys.stdout.isatty() else 10_000
    Console(width=width, highlight=False).print(table, soft_wrap=True)


def check(
    scenario: ScenarioName,
    *,
    planner: PlannerName = None,
    seed: SeedNumber = None,
    overrides: Overrides = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Picture: .png, .svg or .pdf."),
    ] = None,
    allow_planner: AllowPlanner = None,
) -> None:
    """Lay out a scenario without running it, and say what is unusual about it.

    Example: rearview check my_road.yaml -o route.png

    Exit status: 0 it can be run, 2 it cannot.
    """
    with report_user_errors():
        from experiments.cli.shown_log import shown_log
        from experiments.config.scenario_file import load_scenario
        from experiments.episode.preview import preview
        from experiments.world_setup import scenario_network

        loaded = load_scenario(
            scenario,
            planner=planner,
            seed=seed,
            overrides=overrides or (),
            allow_planners=allow_planner or (),
        )
        with shown_log(scenario_network.log):
            if loaded.egos is not None:
                _check_many(loaded, output)
                return
            found = preview(loaded)
        _print_preview(found.facts, found.unusual)
        if output is not None:
            from experiments.report.figures.roads import draw_route
            from experiments.report.figures.save import save_picture

            route = _route_picture(found)
            picture = save_picture(
                "check", output, lambda: draw_route(found.road_map, route)
            )
            sys.stdout.write(f"{picture}\n")


def _check_many(scenario: "Scenario", output: Path | None) -> None:
    """Say what a scenario with many egos comes to; its picture is that of its net."""
    from experiments.episode.fleet_preview import preview_fleet

    if output is not None:
        raise ConfigError(
            f"-o {output}: is for the route of one ego; allowed with egos: rearview net"
        )
    found = preview_fleet(scenario)
    _print_preview(found.facts, found.unusual)


def _print_preview(facts: Iterable[tuple[str, str]], unusual: Iterable[str]) -> None:
    """Print what a scenario comes to."""
    facts = tuple(facts)
    width = max(len(name) for name, _ in facts)
    for name, words in facts:
        sys.stdout.write(f"{name:<{width}}  {words}\n")
    for words in unusual:
        sys.stdout.write(f"unusual: {words}\n")


def _route_picture(found: "ScenarioPreview") -> "RoutePicture":
    """Gather what is drawn of a scenario."""
    import numpy as np

    from experiments.report.figures.outlines import rectangle
    from experiments.report.figures.roads import RoutePicture

    road, task = found.layout.road, found.layout.task
    s = np.arange(0.0, road.path.length, 1.0)

    def points(at: "FloatArray | float", l: "FloatArray | float" = 0.0) -> "FloatArray":
        here = road.path.at(np.atleast_1d(np.asarray(at, dtype=np.float64)))
        x, y = here.x - l * here.sin_heading, here.y + l * here.cos_heading
        return np.column_stack((x, y))

    bounds = road.bounds
    places = {"goal": task.goal, "start": task.start.s}
    if found.sharpest is not None:
        places["sharpest bend"] = found.sharpest
    places |= {stop.signal: stop.s for stop in road.stop_lines}
    bodies = road.obstacles
    return RoutePicture(
        points(s),
        [points(bounds.s, bounds.left), points(bounds.s, bounds.right)],
        {words: points(at) for words, at in places.items()},
        [
            rectangle(*body)
            for body in zip(
                bodies.x,
                bodies.y,
                bodies.heading,
                bodies.length,
                bodies.width,
                bodies.radius,
                strict=True,
            )
        ],
    )
