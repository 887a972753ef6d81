"""The options of `rearview sweep` for continuous integration."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.config.counted import counted

if TYPE_CHECKING:
    from experiments.comparison.gate import Condition
    from experiments.comparison.results import Row


@dataclass(frozen=True, slots=True)
class Gate:
    """What the results of a sweep have to meet, and where that is written."""

    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            "--fail-if",
            metavar="CONDITION",
            help="Exit with status 1 if the runs of any scenario and planner meet it: "
            "collisions > 0 or arrived < 0.95; may be repeated.",
        ),
    ] = None
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Write JUnit XML of the runs."),
    ] = None

    @property
    def is_set(self) -> bool:
        """Tell whether anything is asked."""
        return bool(self.fail_if) or self.junit is not None

    def conditions(self) -> "list[Condition]":
        """Read the conditions, before anything runs; raises ConfigError."""
        from experiments.comparison.gate import Condition

        return [Condition.read(text) for text in self.fail_if or ()]

    def passes(
        self, conditions: "Sequence[Condition]", name: str, rows: "Sequence[Row]"
    ) -> bool:
        """Judge the runs of a sweep, print what fails and write the XML.

        Raises:
            ConfigError: If a condition cannot be decided.
            ResultsError: If the file cannot be written.
        """
        from experiments.comparison.gate import judge
        from experiments.comparison.junit import junit_xml, save_junit

        verdicts = judge(rows, conditions) if conditions else []
        if self.junit is not None:
            save_junit(self.junit, junit_xml(name, rows, verdicts))
            sys.stdout.write(f"junit: {self.junit}\n")
        failing = [verdict for verdict in verdicts if verdict.met]
        for verdict in failing:
            sys.stdout.write(f"failed: {verdict}\n")
        if verdicts and not failing:
            asked = counted(len(conditions), "condition")
            groups = len(verdicts) // len(conditions)  # of a scenario and a planner
            each = f" for each of {groups} scenarios and planners" if groups > 1 else ""
            sys.stdout.write(f"passed: {asked}{each}\n")
        return not failing
