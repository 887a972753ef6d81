"""Asks the official checker, which lives in an environment of its own."""

import json
import os
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from experiments.errors import ConfigError, in_one_line

SCRIPT: Final = Path(__file__).parent / "checker_script.py"
ENVIRONMENT: Final = Path(".venv-commonroad")  # of `make commonroad-checker`
VARIABLE: Final = "REARVIEW_COMMONROAD_PYTHON"
LONGEST: Final = 600.0  # that the checker may take [s]


@dataclass(frozen=True, slots=True)
class CheckReport:
    """What the official checker says of a solution."""

    checks: Mapping[str, str]  # name -> what is wrong, "" if nothing is
    cost: float | None  # None if it could not be computed
    cost_error: str = ""

    @property
    def is_accepted(self) -> bool:
        """Whether every check holds."""
        return not any(self.checks.values())


def find_python(given: Path | None = None) -> Path:
    """Return the Python of the checker's environment.

    Raises:
        ConfigError: If there is none.
    """
    variable = os.environ.get(VARIABLE)
    named = given or (Path(variable) if variable else None)
    python = named or ENVIRONMENT / "bin" / "python"
    if not python.is_file():
        raise ConfigError(
            f"{python}: there is no environment with the official checker; allowed: "
            f"first make commonroad-checker, or --python or {VARIABLE} with another one"
        )
    return python


def check_solution(
    scenario: Path, solution: Path, python: Path, longest: float = LONGEST
) -> CheckReport:
    """Run the official checks in a process of their own.

    Args:
        scenario: File of the scenario.
        solution: File of the solution.
        python: Of the checker's environment.
        longest: After which the process is ended [s].

    Raises:
        ConfigError: If the checker cannot be run, or fails itself.
    """
    command = [python, "-I", SCRIPT, scenario, solution]
    try:
        done = subprocess.run(
            [str(part) for part in command],
            capture_output=True,
            text=True,
            timeout=longest,
            check=False,
        )
    except OSError as error:
        raise ConfigError(f"{python}: cannot be run: {error.strerror}") from error
    except subprocess.TimeoutExpired as error:
        problem = f"the checker was ended after {longest:g} s"
        raise ConfigError(f"{solution}: {problem}") from error
    lines = done.stdout.strip().splitlines()
    try:
        found: dict[str, Any] = json.loads(lines[-1])
        checks = {str(k): str(v) for k, v in found["checks"].items()}
    except (IndexError, ValueError, KeyError, TypeError, AttributeError):
        words = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        problem = f"the checker failed: {in_one_line(words[-1])}"
        raise ConfigError(f"{solution}: {problem}") from None
    cost = found.get("cost")
    return CheckReport(checks, cost, str(found.get("cost_error", "")))
