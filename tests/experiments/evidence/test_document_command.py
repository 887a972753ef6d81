"""A page is written whole, or what is there is left."""

import argparse

import pytest

from experiments.errors import ConfigError
from experiments.evidence.document_command import write_document


def test_a_page_is_written_where_it_is_asked_for(tmp_path):
    parser = argparse.ArgumentParser()
    parser.add_argument("words")
    page = tmp_path / "page.md"
    made = write_document(parser, lambda o: o.words, ["new", "-o", str(page)])
    assert (made, page.read_text()) == (0, "new")


@pytest.mark.parametrize("error", [ConfigError("bad sweep"), OSError("no such file")])
def test_an_error_is_one_line_and_leaves_the_page(error, tmp_path, capsys):
    page = tmp_path / "page.md"
    page.write_text("old")

    def fails(_):
        raise error

    assert write_document(argparse.ArgumentParser(), fails, ["-o", str(page)]) == 2
    assert page.read_text() == "old"
    assert capsys.readouterr().err == f"{error}\n"
    assert [file.name for file in tmp_path.iterdir()] == ["page.md"]
