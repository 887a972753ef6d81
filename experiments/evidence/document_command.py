"""The commands that write a generated page of the documentation."""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.comparison.results import Row, rows
from experiments.errors import ExperimentError
from experiments.storage.atomic_folder import write_atomically


def write_from_sweeps(
    name: str,
    description: str | None,
    document: Callable[[Sequence[Row]], str],
    arguments: Sequence[str] | None = None,
) -> int:
    """Make a page from folders of finished sweeps; see `write_document`.

    Args:
        name: Of the command.
        description: Its help.
        document: Returns the text, from the rows of all folders.
        arguments: Of the command line; those of the process if None.
    """
    parser = argparse.ArgumentParser(prog=name, description=description)
    parser.add_argument("folders", nargs="+", type=Path, help="of finished sweeps")
    return write_document(
        parser,
        lambda options: document([r for one in options.folders for r in rows(one)]),
        arguments,
    )


def write_document(
    parser: argparse.ArgumentParser,
    make: Callable[[argparse.Namespace], str],
    arguments: Sequence[str] | None = None,
) -> int:
    """Make a page and write it where `-o` says, or leave what is there.

    Args:
        parser: Of what the page is made from; `-o` is added.
        make: Returns the text, from the options.
        arguments: Of the command line; those of the process if None.

    Returns:
        Exit status: 0, or 2 on an error, which stderr names in a line.
    """
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args(arguments)
    try:
        write_atomically(options.output, make(options))
    except (ExperimentError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0
