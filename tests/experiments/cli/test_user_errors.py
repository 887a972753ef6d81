"""Errors in one line, and a reader of stdout that has read enough."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from experiments.cli.app import app
from experiments.cli.user_errors import error_line, report_user_errors
from experiments.comparison.results import rebuild
from experiments.errors import MESSAGE_LIMIT, ConfigError
from tests.experiments.report.run_folders import write_sweep

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def sweep(tmp_path_factory) -> str:
    folder = write_sweep(tmp_path_factory.mktemp("made") / "sweep", seeds=2)
    rebuild(folder)
    return str(folder)


@pytest.mark.parametrize(
    "command",
    [
        "--help",
        "--version",
        pytest.param("list", marks=pytest.mark.slow),
        "schema",
        "run --help",
        "results SWEEP",
        pytest.param("results SWEEP --format csv", marks=pytest.mark.slow),
        pytest.param("results SWEEP --format json", marks=pytest.mark.slow),
        pytest.param("compare SWEEP --baseline cruise", marks=pytest.mark.slow),
        pytest.param("report SWEEP", marks=pytest.mark.slow),
    ],
)
def test_nobody_reads_what_is_printed(command, sweep):
    words = [sweep if word == "SWEEP" else word for word in command.split()]
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as closed:
        done = subprocess.run(
            [sys.executable, "-m", "experiments", *words],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=closed,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.stderr == ""
    assert done.returncode == 141


def test_long_messages_are_one_line_of_limited_length(capsys):
    with pytest.raises(typer.Exit) as left, report_user_errors():
        raise ConfigError("a\n  b " + "x" * 10_000)
    error = capsys.readouterr().err
    assert left.value.exit_code == 2
    assert error.startswith("rearview: a b xxx")
    assert error.count("\n") == 1
    assert len(error) <= MESSAGE_LIMIT + len("rearview: \n")
    assert error_line(ConfigError("")) == "ConfigError"


@pytest.mark.parametrize(
    "command",
    [
        ("results",),
        ("compare", "--baseline", "x"),
        ("report",),
        ("figure",),
        ("rerun", "ab"),
        ("replan", "--step", "0"),
        ("video", "-o", "film.gif"),
    ],
)
def test_a_missing_folder_is_called_missing(command, tmp_path, capsys):
    name, *options = command
    with pytest.raises(SystemExit) as left:
        app([name, str(tmp_path / "nothing"), *options])
    assert left.value.code == 2
    expected = f"rearview: {tmp_path}/nothing: there is no such folder\n"
    assert capsys.readouterr().err == expected
