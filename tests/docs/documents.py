"""The documents of the project, and the code blocks and commands in them."""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import typer
import typer.main

from experiments.cli.app import app

ROOT = Path(__file__).parents[2]
PATTERNS = (
    "*.md",
    "planner/*.md",
    "sumo_nets/*.md",
    "experiments/*.md",
    "docs/**/*.md",
)
DOCUMENTS = sorted(path for pattern in PATTERNS for path in ROOT.glob(pattern))
TEXTS = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in DOCUMENTS
}
INDENTED = re.compile(r"^    ((?:make|rearview) .*)$", re.MULTILINE)
OURS = re.compile(r"(?:make|rearview) ")


def blocks(text: str, language: str) -> list[str]:
    """Return the code blocks of a language in a document."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def commands(text: str) -> Iterator[str]:
    """Yield each make and rearview command of a document, without its comment.

    Blocks marked `bash` are scripts: commands that go over several lines in quotes are
    left out there, as are variables.
    """
    outside = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    yield from (_plain(line) for line in INDENTED.findall(outside))
    for block in blocks(text, "sh"):
        yield from (_plain(line) for line in block.splitlines() if OURS.match(line))
    for block in blocks(text, "bash"):
        for line in block.replace("\\\n", " ").splitlines():
            if OURS.match(line) and "$" not in line and line.count('"') % 2 == 0:
                yield _plain(line.partition(" #")[0].rstrip(" &"))


def _plain(line: str) -> str:
    return shlex.join(shlex.split(line, comments=True))


def all_commands() -> list[str]:
    """Return every command of all documents once."""
    return sorted({command for text in TEXTS.values() for command in commands(text)})


def make(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run make as from a shell, also where make runs the tests."""
    own = ("MAKEFLAGS", "MAKELEVEL", "MFLAGS", "NET", "RUN", "ARGS")
    clean = {key: value for key, value in os.environ.items() if key not in own}
    return subprocess.run(
        ["make", *arguments],
        cwd=ROOT,
        env={**clean, **variables},
        capture_output=True,
        text=True,
        check=False,
    )


def rearview_arguments(command: str) -> list[str]:
    """Return what `rearview` gets from a command of either kind; [] if nothing."""
    words = shlex.split(command)
    if words[0] == "rearview":
        return words[1:]
    done = make("-n", *words[1:], RUN="runs/some")
    assert done.returncode == 0, done.stderr
    calls = [
        shlex.split(line)
        for line in done.stdout.replace("\\\n", " ").splitlines()
        if line.startswith(".venv/bin/rearview ")
    ]
    through_make = {"experiment", "figure", "report", "sweep", "thesis", "results"}
    through_make.add("robustness-docs")
    assert bool(calls) == (words[1] in {*through_make, "thesis-docs", "schema"}), words
    return calls[-1][1:] if words[1] in through_make else []


def parse(arguments: list[str]) -> typer.Context:
    """Parse as the command line does, without running anything."""
    group = typer.main.get_command(app)
    outer = group.make_context("rearview", list(arguments))
    _, command, rest = group.resolve_command(outer, list(arguments))
    return command.make_context(command.name, rest, parent=outer)


def run_in(
    folder: Path, *arguments: str, timeout: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder, with this project on its path and `rearview` in PATH."""
    tools = str(Path(sys.executable).parent)
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={
            **os.environ,
            # the second holds the package rearview, as an installation has it
            "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'experiments' / 'api'}",
            "PATH": tools + os.pathsep + os.environ["PATH"],
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=timeout,
    )


def rearview(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in a folder."""
    return run_in(folder, "-m", "experiments", *arguments)
