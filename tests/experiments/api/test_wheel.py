"""The wheel: built from a copy of the sources and used far from them."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.docs.documents import ROOT, TEXTS, blocks

SOURCES = ("planner", "sumo_nets", "experiments")
FILES = ("pyproject.toml", "README.md", "LICENSE", "rearview_command.py")


def run(*arguments: str, folder: Path, path: Path | None) -> str:
    environment = {**os.environ, "PYTHONPATH": "" if path is None else str(path)}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=300.0,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_wheel_holds_one_package_rearview_that_works_elsewhere(tmp_path):
    copy, site, work = (tmp_path / name for name in ("copy", "site", "work"))
    skipped = shutil.ignore_patterns("__pycache__", "_kernels", "*.egg-info")
    for name in SOURCES:
        shutil.copytree(ROOT / name, copy / name, ignore=skipped)
    for name in FILES:
        shutil.copy(ROOT / name, copy / name)
    work.mkdir()
    options = ("--no-deps", "--no-build-isolation", "-q", "-w", str(tmp_path))
    run("-m", "pip", "wheel", *options, str(copy), folder=tmp_path, path=None)
    (wheel,) = tmp_path.glob("rearview-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        archive.extractall(site)
    assert "rearview/__init__.py" in names
    assert "rearview/py.typed" in names
    assert not [name for name in names if name.startswith("experiments/api/rearview")]
    assert not [name for name in names if name.startswith("tests/")]
    shutil.rmtree(copy)
    places = run(
        "-c",
        "import rearview, experiments; print(rearview.__file__, experiments.__file__)",
        folder=work,
        path=site,
    )
    assert places.split() == [
        str(site / "rearview" / "__init__.py"),
        str(site / "experiments" / "__init__.py"),
    ]
    examples = "\n".join(blocks(TEXTS["docs/api/python.md"], "python"))
    (work / "examples.py").write_text(examples, encoding="utf-8")
    printed = run("examples.py", folder=work, path=site)
    assert "arrived" in printed
    assert {"run.svg", "table.tex", "runs", "sweeps"} <= {
        x.name for x in work.iterdir()
    }
    (work / "planner.py").write_text("", encoding="utf-8")
    hidden = "try:\n import rearview\nexcept ImportError as error: print(error)"
    assert "the name planner is taken" in run("-c", hidden, folder=work, path=site)
