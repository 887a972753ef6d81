"""Version and date are the same wherever they are written."""

import re
import tomllib

import yaml

from tests.docs.documents import ROOT, TEXTS

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]


def test_changelog_and_citation_name_the_version():
    releases = re.findall(
        r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$",
        TEXTS["CHANGELOG.md"],
        re.MULTILINE,
    )
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert releases[0][0] == PROJECT["version"] == citation["version"]
    assert releases[0][1] == citation["date-released"].isoformat()


def test_development_installs_every_extra():
    extras = PROJECT["optional-dependencies"]
    (all_of_them,) = (need for need in extras["dev"] if need.startswith("rearview["))
    named = set(re.findall(r"\w+", all_of_them)) - {"rearview"}
    assert named == set(extras) - {"dev"}


def test_everything_that_is_installed_is_pinned():
    pins = (ROOT / "constraints.txt").read_text(encoding="utf-8").lower()
    names = {line.partition("==")[0].replace("_", "-") for line in pins.splitlines()}
    extras = PROJECT["optional-dependencies"].values()
    for need in [
        *PROJECT["dependencies"],
        *(need for extra in extras for need in extra),
    ]:
        name = re.match(r"[\w-]+", need)[0].lower().replace("_", "-")
        assert name == "rearview" or name in names, need
