"""Networks by netgenerate, which comes with eclipse-sumo."""

import importlib.util
import subprocess
from pathlib import Path

import pytest


def netgenerate():
    """Find the program; the calling test is skipped without it."""
    spec = importlib.util.find_spec("sumo")
    for folder in (spec.submodule_search_locations or []) if spec else []:
        program = Path(folder) / "bin" / "netgenerate"
        if program.is_file():
            return program
    return pytest.skip("netgenerate is not there")


def generate(folder, *options, turnarounds=False):
    """Generate a network; the same options give the same one."""
    file = folder / "generated.net.xml"
    program = netgenerate()
    command = [program, *options, "-o", file]
    if not turnarounds:
        command.append("--no-turnarounds")
    home = str(program.parent.parent)
    subprocess.run(
        command, env={"SUMO_HOME": home}, capture_output=True, check=True, timeout=60
    )
    return file
