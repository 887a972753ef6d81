"""Arguments and options of the commands that take a scenario."""

from typing import Annotated

import typer

ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE",
        help="Shipped scenario, a .yaml file, a network, or a CommonRoad .xml.",
    ),
]
PlannerName = Annotated[
    str | None,
    typer.Option("--planner", help="Registered planner, or module:factory."),
]
SeedNumber = Annotated[
    int | None, typer.Option("--seed", help="Seed of traffic and obstacles.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Override a key: ego.goal_m=200."),
]
AllowPlanner = Annotated[
    list[str] | None,
    typer.Option(
        "--allow-planner",
        metavar="MODULE",
        help="Allow the file to name this module as planner; its code is run.",
    ),
]
