"""The page about continuous integration: its commands are run as they stand."""

import json
import re
import shlex
import shutil
from xml.etree import ElementTree as ET

import pytest
import yaml

from experiments.config.sweep_file import load_sweep
from experiments.cosim.sumo.system_libraries import PACKAGES
from tests.docs.documents import TEXTS, blocks, commands, parse, rearview

TEXT = TEXTS["docs/ci.md"]
SWEEP, GITHUB, GITLAB = blocks(TEXT, "yaml")
(DOCKERFILE,) = blocks(TEXT, "dockerfile")
STEPS = [line for line in DOCKERFILE.splitlines() if line]


def ours(lines):
    return [line for line in lines if line.startswith("rearview ")]


def docker_commands():
    run = [line.removeprefix("RUN ") for line in STEPS if line.startswith("RUN ")]
    (entry,) = (x for x in STEPS if x.startswith("ENTRYPOINT "))
    (last,) = (x for x in STEPS if x.startswith("CMD "))
    words = json.loads(entry.partition(" ")[2]) + json.loads(last.partition(" ")[2])
    return [*ours(run), shlex.join(words)]


def github_commands():
    steps = yaml.safe_load(GITHUB)["jobs"]["drive"]["steps"]
    return ours(step["run"] for step in steps if "run" in step)


def gitlab_commands():
    return ours(yaml.safe_load(GITLAB)["drive"]["script"])


@pytest.mark.parametrize("found", [docker_commands, github_commands, gitlab_commands])
def test_commands_parse_and_judge_the_sweep_of_the_page(found):
    given = [parse(shlex.split(command)[1:]).params for command in found()]
    assert len(given) >= 2
    judged = [one for one in given if one.get("fail_if")]
    assert [str(one["junit"]) for one in judged] == ["junit.xml"]
    assert judged[0]["file"] == "ci.yaml"


def test_images_get_the_libraries_that_sumo_needs():
    for text in (GITLAB, DOCKERFILE):
        (line,) = (x for x in text.splitlines() if "apt-get install" in x)
        assert {debian for debian, _ in PACKAGES.values()} <= set(line.split())


def test_the_dockerfile_has_only_known_steps_and_copies_what_the_page_shows():
    known = {"FROM", "ARG", "RUN", "WORKDIR", "COPY", "ENTRYPOINT", "CMD"}
    assert {line.split()[0] for line in STEPS} == known
    (copy,) = (line.split()[1:-1] for line in STEPS if line.startswith("COPY"))
    assert copy == ["my_planner.py", "ci.yaml"]


@pytest.mark.slow
@pytest.mark.sumo
def test_the_job_does_what_the_page_says(tmp_path):
    (planner,) = blocks(TEXTS["docs/tutorials/own_planner.md"], "python")
    (tmp_path / "my_planner.py").write_text(planner, encoding="utf-8")
    (tmp_path / "ci.yaml").write_text(SWEEP, encoding="utf-8")
    assert load_sweep(str(tmp_path / "ci.yaml"))[0].count == 8
    few = SWEEP.replace("count: 8", "count: 6")
    (tmp_path / "ci.yaml").write_text(few, encoding="utf-8")
    drive, compare = gitlab_commands()
    assert github_commands() == [drive, compare]
    assert shlex.split(docker_commands()[-1]) == shlex.split(drive)
    done = rearview(*shlex.split(drive)[1:], folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    root = ET.parse(tmp_path / "junit.xml").getroot()
    assert (root.get("tests"), root.get("failures")) == ("7", "0")
    shutil.copy(tmp_path / "sweeps/ci/results.parquet", tmp_path / "baseline.parquet")
    for command in {compare, *(c for c in commands(TEXT) if " compare " in c)}:
        done = rearview(*shlex.split(command)[1:], folder=tmp_path)
        assert done.returncode == 0, command + done.stdout + done.stderr
        assert re.match("no metric got worse: [1-9]", done.stdout)
