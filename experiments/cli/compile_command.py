"""`rearview compile`: compile the inner loops before they are needed."""

import os
import sys
from typing import Annotated

import typer

from experiments.cli.user_errors import BAD_INPUT, report_user_errors
from experiments.errors import ConfigError


def add_to(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command("compile")(compile_)


def compile_(
    families: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FAMILY]...", help="cruise, dense, lane_change.  [all]"
        ),
    ] = None,
    *,
    in_package: Annotated[
        bool,
        typer.Option(
            "--in-package",
            help="Keep them inside the package: for images, wheels, copies.",
        ),
    ] = False,
) -> None:
    """Compile the inner loops of planners for this processor, on all its cores.

    Without it, the first run of each planner family does so.

    Example: rearview compile cruise

    Exit status: 0 done, 2 bad input, or no folder to write to.
    """
    with report_user_errors():
        import numba

        from experiments.cli.compile_notice import compile_all
        from experiments.cli.kernel_list import kernel_list, missing
        from experiments.cli.shown_log import shown_log
        from experiments.config.validation_errors import unknown_name
        from planner.numerics import kernel_cache

        if in_package:
            folder = str(kernel_cache.PACKAGE_FOLDER)
            os.environ["NUMBA_CACHE_DIR"] = numba.config.CACHE_DIR = folder
        asked = families or list(kernel_list())
        for name in asked:
            if name not in kernel_list():
                known = unknown_name(name, list(kernel_list()))
                raise ConfigError(f"there is no planner family {name!r}; {known}")
        with shown_log(kernel_cache.log):
            if not kernel_cache.is_writable():
                sys.stderr.write("rearview: no folder for compiled loops is writable\n")
                raise typer.Exit(BAD_INPUT)
            lacking = missing(asked)
            if lacking:
                compile_all(lacking)
            left = len(missing(asked))
    sys.stdout.write(
        f"compiled {len(lacking) - left} functions into {kernel_cache.folders()[0]}\n"
    )
