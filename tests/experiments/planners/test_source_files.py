import importlib
import sys

import pytest

from experiments.errors import ConfigError
from experiments.planners.source_files import planner_sources

FILES = {
    "main_of_mine.py": """
import json
import numpy as np
from planner.interface import PlanResult
import helper_of_mine

def make():
    from package_of_mine.deep import late
""",
    "helper_of_mine.py": "BRAKE = 3.0",
    "unrelated_of_mine.py": "",
    "package_of_mine/__init__.py": "",
    "package_of_mine/base.py": "",
    "package_of_mine/unused.py": "",
    "package_of_mine/deep/__init__.py": "",
    "package_of_mine/deep/late.py": "from .. import base",
    "spaces_of_mine/inner.py": "",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    planner_sources.cache_clear()
    for name in [name for name in sys.modules if "_of_mine" in name]:
        del sys.modules[name]


def sources(folder, module):
    importlib.import_module(module)
    found = planner_sources(module)
    return {str(file.relative_to(folder.resolve())) for file in found}


def test_what_a_planner_imports_from_beside_belongs_to_it(folder):
    assert sources(folder, "main_of_mine") == {
        "main_of_mine.py",
        "helper_of_mine.py",
        "package_of_mine/__init__.py",
        "package_of_mine/base.py",
        "package_of_mine/deep/__init__.py",
        "package_of_mine/deep/late.py",
    }


def test_a_planner_in_a_package(folder):
    assert sources(folder, "package_of_mine.deep.late") == {
        "package_of_mine/__init__.py",
        "package_of_mine/base.py",
        "package_of_mine/deep/__init__.py",
        "package_of_mine/deep/late.py",
    }


def test_a_planner_in_a_package_without_a_file(folder):
    assert sources(folder, "spaces_of_mine.inner") == {"spaces_of_mine/inner.py"}


def test_of_installed_packages_only_its_own_is_looked_at():
    importlib.import_module("pydantic.main")
    found = planner_sources("pydantic.main")
    assert len(found) > 1
    assert all("pydantic" in file.parts for file in found)


def test_a_broken_file_is_one_line(folder):
    (folder / "package_of_mine/base.py").write_text("def broken(:")
    importlib.import_module("main_of_mine")
    with pytest.raises(ConfigError, match=r"main_of_mine: .*base.py, line 1: "):
        planner_sources("main_of_mine")


def test_what_has_no_file_has_no_sources():
    assert planner_sources("builtins") == ()
