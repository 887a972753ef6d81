"""The generated parts of the site, and the site itself."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from experiments.config.scenario_file import schema_text
from experiments.config.search_file import search_schema
from experiments.config.sweep_file import sweep_schema
from experiments.metrics.catalogue import ALL_COLUMNS
from tests.docs.documents import ROOT, TEXTS

NO_MKDOCS = importlib.util.find_spec("mkdocs") is None


@pytest.fixture(scope="module")
def gen_pages():
    spec = importlib.util.spec_from_file_location(
        "gen_pages", ROOT / "docs/gen_pages.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_metric_is_defined(gen_pages):
    page = gen_pages.fill(TEXTS["docs/reference/metrics.md"])
    defined = re.findall(r"^\| (`[^|]*`)", page, re.MULTILINE)
    names = [name for cell in defined for name in re.findall(r"`(\w+)`", cell)]
    assert sorted(names) == sorted(ALL_COLUMNS)


@pytest.mark.parametrize(
    ("page", "schema"),
    [
        ("scenario_files", json.loads(schema_text())),
        ("sweep_files", sweep_schema()),
        ("search", search_schema()),
    ],
)
def test_every_key_has_a_row(gen_pages, page, schema):
    text = gen_pages.fill(TEXTS[f"docs/reference/{page}.md"]).partition("## All keys")[
        2
    ]
    rows = set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE))
    sections = [schema, *schema["$defs"].values()]
    keys = {key for section in sections for key in section.get("properties", {})}
    assert rows == keys


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "number", "minimum": 0, "maximum": 70}, "number (0 to 70)"),
        ({"type": "number", "exclusiveMinimum": 0}, "number (above 0)"),
        ({"type": "integer", "maximum": 3}, "integer (at most 3)"),
        ({"enum": ["light", "dense"]}, "`light`, `dense`"),
        ({"anyOf": [{"const": "none"}, {"type": "null"}]}, "`none`"),
        ({"$ref": "#/$defs/Ego"}, "[Ego](#ego)"),
        ({"type": "array", "items": {"type": "string"}}, "list of text"),
        (
            {"type": "array", "prefixItems": [{"type": "integer"}] * 2},
            "[integer, integer]",
        ),
    ],
)
def test_what_is_allowed_is_said_in_words(gen_pages, schema, words):
    assert gen_pages._allowed(schema) == words


def test_an_unknown_mark_is_an_error(gen_pages):
    with pytest.raises(KeyError, match="moons"):
        gen_pages.fill("<!-- generated: moons -->")


def test_bars_in_a_cell_are_escaped(gen_pages):
    section = {"properties": {"a": {"type": "string", "description": "x | y"}}}
    assert r"x \| y" in gen_pages._table(section)


@pytest.mark.skipif(NO_MKDOCS, reason="needs the documentation's packages")
@pytest.mark.slow
def test_the_site_builds_strictly_and_fetches_nothing(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(tmp_path)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    pages = list(tmp_path.rglob("*.html"))
    assert len(pages) > 25
    for page in pages:
        html = page.read_text(encoding="utf-8")
        assert not re.search(r'<(?:script|img|link)\b[^>]*(?:src|href)="?https?:', html)
        assert "generated:" not in html
    scene = (tmp_path / "api/scene.html").read_text(encoding="utf-8")
    assert "since the ego entered [s]" in scene  # the comment beside a field
    shutil.rmtree(tmp_path)
