"""`rearview tube`: measure the tracking errors of a scenario's plant."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.cli.scenario_options import Overrides
from experiments.cli.user_errors import report_user_errors
from experiments.cli.written_or_printed import write_or_print


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command()(tube)


def tube(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME|FILE", help="Scenario whose ego has a plant."),
    ],
    *,
    overrides: Overrides = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Tube file; default: print it.")
    ] = None,
) -> None:
    """Write by how much a plant misses its plans, by speed and curvature.

    Example: rearview tube straight --set ego.plant=dynamic -o tube.json

    Exit status: 0 done, 2 bad input.
    """
    with report_user_errors():
        from experiments.config.scenario_file import load_scenario
        from experiments.cosim.plants.tube import measure_tube
        from experiments.errors import ConfigError
        from experiments.world_setup.vehicle_model import plant_settings

        loaded = load_scenario(name, overrides=overrides or ())
        settings = plant_settings(loaded)
        if settings is None:
            raise ConfigError(
                f"{name}: ego.plant: is perfect, which has no tracking errors; "
                "allowed: kinematic or dynamic"
            )
        write_or_print(measure_tube(settings).to_json(), out)
