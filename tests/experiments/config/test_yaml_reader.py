"""The traps of YAML, one by one."""

import math
import os
from time import monotonic

import pytest
import yaml

from experiments.config.yaml_reader import (
    dotted,
    parse_document,
    parse_scalar,
    read_document,
)
from experiments.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),  # PyYAML alone: the string '1e-3'
        ("1E5", 1e5),
        (".5", 0.5),
        ("3.", 3.0),
        ("-0x1F", "-0x1F"),
        ("0x1F", 31),
        ("0o17", 15),
        ("017", 17),  # PyYAML alone: 15
        ("-12", -12),
        ("12:30", "12:30"),  # PyYAML alone: 750
        ("NO", "NO"),  # PyYAML alone: False
        ("yes", "yes"),
        ("on", "on"),
        ("true", True),
        ("False", False),
        ("null", None),
        ("~", None),
        ("", None),
        ("2001-01-01", "2001-01-01"),  # PyYAML alone: a date
        ("1_000", "1_000"),  # PyYAML alone: 1000
        ("'3'", "3"),
        ("[1, 2.0, a]", [1, 2.0, "a"]),
        ("{a: 1}", {"a": 1}),
    ],
)
def test_scalars_follow_yaml_1_2(text, value):
    found = parse_scalar(text)
    assert found == value
    assert type(found) is type(value)


def test_infinities_and_nan():
    assert parse_scalar(".inf") == math.inf
    assert parse_scalar("-.inf") == -math.inf
    assert math.isnan(parse_scalar(".nan"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3\n", "f.yaml:3: a: is given twice, first at f.yaml:1"),
        ("a:\n  b: 1\n  b: 1\n", "f.yaml:3: a.b: is given twice, first at f.yaml:2"),
        ("a: &x 1\nb: *x\n", "f.yaml:1: b: is an alias"),
        ("1: a\n", "f.yaml:1: the file: has a key that is not a name: '1'"),
        ("true: a\n", "has a key that is not a name"),
        ("a: {<<: {b: 1}}\n", "has a key that is not a name: '<<'"),
        ("a: [1, 2\n", "is not YAML"),
        ("a: !!python/object/apply:os.getcwd []\n", "f.yaml:1: a: has an unknown type"),
        ("a: !!int abc\n", "f.yaml:1: a: is not a valid int: 'abc'"),
        ("a: !mine 3\n", "f.yaml:1: a: has an unknown type"),
        ("a: 1\n---\nb: 1\n", "is not YAML"),
        ("a: \x07\n", "is not YAML"),
    ],
)
def test_refused(text, message):
    with pytest.raises(ConfigError) as caught:
        parse_document(text, "f.yaml")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_places_of_nested_keys():
    document = parse_document("a:\n  b:\n    - x: 1\n    - x: 2\n", "f.yaml")
    assert document.where(("a", "b", 1, "x")) == "f.yaml:4"
    assert document.where(("a", "b", 1, "missing")) == "f.yaml:4"
    assert document.where(()) == "f.yaml:1"


def test_plain_files_read_as_pyyaml_reads_them():
    text = "a: 1\nb: [x, 2.5, {c: true}]\nd: |\n  two\n  lines\ne: null\n"
    assert parse_document(text, "f").data == yaml.safe_load(text)


def test_a_pipe_is_not_waited_for(tmp_path):
    pipe = tmp_path / "pipe.yaml"
    os.mkfifo(pipe)
    with pytest.raises(ConfigError, match=r"pipe\.yaml: is a pipe; allowed: a file"):
        read_document(pipe)


def test_unreadable_files(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml: cannot be read: No such file"):
        read_document(tmp_path / "none.yaml")
    (tmp_path / "latin.yaml").write_bytes(b"a: \xe9\n")
    with pytest.raises(ConfigError, match="is not UTF-8"):
        read_document(tmp_path / "latin.yaml")


def test_dotted():
    assert dotted(("a", "b", 0, "c", 1, 2)) == "a.b[0].c[1][2]"


@pytest.mark.parametrize("depth", [900, 5000])
def test_bottomless_nesting_is_one_line(depth):
    with pytest.raises(ConfigError, match=r"^deep.yaml: is nested too deeply$"):
        parse_document("a: " + "[" * depth + "]" * depth, "deep.yaml")


def test_large_files_are_refused_before_they_are_parsed(tmp_path):
    file = tmp_path / "large.yaml"
    file.write_text("# comment\n" * 500_000)
    before = monotonic()
    with pytest.raises(
        ConfigError, match=r"large.yaml: is too large; allowed: up to 1"
    ):
        read_document(file)
    assert monotonic() - before < 1.0
    with pytest.raises(ConfigError, match="too large"):
        parse_scalar(f"'{'x' * 1_000_001}'")
    file.write_text(f"a: {'x' * 999_000}")
    assert len(read_document(file).data["a"]) == 999_000
