import re

import pytest

from experiments.commonroad.xml_tree import DEEPEST, SHOWN, read_xml, short
from experiments.errors import ConfigError


def tree(folder, text):
    file = folder / "a.xml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_xml(file)


def test_elements_keep_order_text_attributes_and_lines(tmp_path):
    root = tree(tmp_path, "<a>\n<b id='3'> 1.5 </b>\n<c/><b id='4'><d/>x</b></a>")
    assert [(node.tag, node.line) for node in root.children] == [
        ("b", 2),
        ("c", 3),
        ("b", 3),
    ]
    assert [node.key() for node in root.all("b")] == [3, 4]
    assert root.child("b").text == "1.5"
    assert root.need("b").number() == 1.5
    assert root.child("gone") is None
    assert [node.text for node in root.all("b", "c")] == ["1.5", "", ""]


@pytest.mark.parametrize(
    ("text", "method", "problem"),
    [
        ("<a/>", lambda root: root.need("b"), "a.xml:1: a: has no b"),
        ("<a>x</a>", lambda root: root.number(), "a.xml:1: a: is 'x'; allowed: a num"),
        ("<a>nan</a>", lambda root: root.number(), "is 'nan'; allowed: a number"),
        ("<a>1e9</a>", lambda root: root.number(), "is '1e9'; allowed: a number"),
        ("<a/>", lambda root: root.number(), "is ''; allowed: a number"),
        ("<a>0</a>", lambda root: root.positive(), "is 0; allowed: more than 0"),
        ("<a>1.5</a>", lambda root: root.whole(), "is 1.5; allowed: a whole number"),
        ("<a/>", lambda root: root.key(), "a: has no id"),
        (
            "<a id='x'/>",
            lambda root: root.key(),
            "a.xml:1: a 'x': id is 'x'; allowed: a whole number",
        ),
        ("<a><b ref='1.5'/></a>", lambda root: root.refs("b"), "ref is '1.5'"),
    ],
)
def test_what_is_wrong_has_file_line_and_element(tmp_path, text, method, problem):
    root = tree(tmp_path, text)
    with pytest.raises(ConfigError, match=re.escape(problem)):
        method(root)


def test_whole_numbers_and_references(tmp_path):
    root = tree(tmp_path, "<a><b ref='1'/><b ref='-2'/><c>3.0</c></a>")
    assert root.refs("b") == (1, -2)
    assert root.need("c").whole() == 3


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<a>", "a.xml:1: is no XML: no element found"),
        ("", "is no XML: no element found"),
        ("<a>\n</b>", "a.xml:2: is no XML: mismatched tag"),
        (b"<?xml version='1.0' encoding='nope'?><a/>", "is no XML: unknown encoding"),
        ("<!DOCTYPE a><a/>", "has a document type (DOCTYPE); allowed"),
        (
            "<a>" * (DEEPEST + 1) + "</a>" * (DEEPEST + 1),
            f"allowed: at most {DEEPEST} elements inside each other",
        ),
    ],
)
def test_what_is_no_plain_xml_is_refused(tmp_path, text, problem):
    with pytest.raises(ConfigError, match=re.escape(problem)):
        tree(tmp_path, text)


def test_a_file_as_deep_as_allowed_is_read(tmp_path):
    node = tree(tmp_path, "<a>" * DEEPEST + "</a>" * DEEPEST)
    for _ in range(DEEPEST - 1):
        (node,) = node.children
    assert node.children == []


def test_a_file_that_cannot_be_read_is_one_line(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read: No such file"):
        read_xml(tmp_path / "gone.xml")
    with pytest.raises(ConfigError, match="cannot be read: Is a directory"):
        read_xml(tmp_path)


def test_values_in_messages_are_cut():
    assert short("a\n b") == "'a b'"
    assert short("x" * (SHOWN + 1)) == f"'{'x' * SHOWN}...'"
