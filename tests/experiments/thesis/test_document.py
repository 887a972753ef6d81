import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from experiments.thesis.document import document
from experiments.thesis.drawing import svg
from experiments.thesis.page import thesis_page

SVG = "{http://www.w3.org/2000/svg}"
DOCS = Path(__file__).parents[3] / "docs"
NUMBER = re.compile(r"\d+(?:\.\d+)*(?:e[+-]?\d+)?")


def foreign_numbers(text: str, data: str) -> set[str]:
    """Numbers of a text that stand nowhere in the data."""
    return set(NUMBER.findall(text)) - set(NUMBER.findall(data))


@pytest.fixture(scope="module")
def numbers():
    return json.loads((DOCS / "thesis.json").read_text(encoding="utf-8"))


def test_every_number_of_the_document_is_in_the_numbers_file():
    text = (DOCS / "thesis.md").read_text(encoding="utf-8")
    data = (DOCS / "thesis.json").read_text(encoding="utf-8")
    assert foreign_numbers(text, data) == set()
    assert foreign_numbers(f"{text} 31.4159", data) == {"31.4159"}


def test_the_document_is_what_the_numbers_file_gives(numbers):
    assert (DOCS / "thesis.md").read_text(encoding="utf-8") == document(numbers)


def test_the_documented_run_is_a_full_one(numbers):
    assert numbers["quick"] is False
    assert [chapter["number"] for chapter in numbers["chapters"]] == [4, 5, 6]
    assert not any(chapter["missing"] for chapter in numbers["chapters"])


def test_every_published_improvement_has_its_sign_on_the_picked_layouts(numbers):
    claims = {c["id"]: c for ch in numbers["chapters"] for c in ch["claims"]}
    signs = [c for name, c in claims.items() if re.match(r"4\.2_[a-z_]+_\w+", name)]
    published = [c for c in signs if "sumo" not in c["id"]]
    published += [claims[f"{t}_{f}"] for t in ("5.3", "5.5") for f in FIELDS]
    assert len(published) == 12
    assert all(claim["picked"] for claim in published)
    for n in range(1, 5):
        measured = claims[f"5.2_{n}_higher"]["measured"]
        assert measured["adaptive"] > measured["conventional"]
    timed = [c for ch in numbers["timing"]["chapters"] for c in ch["claims"]]
    assert next(c for c in timed if c["id"] == "6.1_time")["picked"]


FIELDS = ("length", "max_heading")


def test_every_claim_that_fails_says_why(numbers):
    claims = [c for chapter in numbers["chapters"] for c in chapter["claims"]]
    assert len(claims) > 50
    assert all(claim["reason"] for claim in claims if claim["verdict"] != "holds")


def picture(name="a"):
    series = {"name": name, "x": [0.0, 1.0, 2.0], "y": [1.0, 3.0, 2.0]}
    facts = {"id": "p", "title": name, "x": "s m", "y": "l m"}
    return {**facts, "series": [series], "discs": [[1.0, 2.0, 0.5]], "points": []}


def test_the_page_holds_every_claim_and_nothing_that_could_run(numbers):
    drawn = {4: [picture("<script>alert(1)</script>")], 5: [], 6: []}
    page = thesis_page(numbers, drawn)
    assert "<script>alert" not in page
    assert page.count('<img src="data:image/svg+xml;base64,') == 1
    for chapter in numbers["chapters"]:
        for claim in chapter["claims"]:
            assert claim["place"] in page


def test_picture_shows_lines_discs_points_and_names_without_markup():
    drawn = {**picture("<script>"), "points": [[1.0, 2.0], [9.0, 2.0]]}
    drawn["series"] = [*drawn["series"], {"name": "b", "x": [0.0], "y": [1.0]}]
    text = svg(drawn)
    root = ElementTree.fromstring(text)
    words = {"".join(element.itertext()).strip() for element in root.iter(f"{SVG}text")}
    assert {"s m", "l m", "<script>", "b", "8"} <= words  # as far as the points reach
    assert svg(drawn) == text


def test_a_picture_of_a_level_line_has_an_axis():
    flat = picture()
    flat["series"][0]["y"] = [1.0, 1.0, 1.0]
    flat["discs"] = []
    assert "s m" in svg(flat)


def test_a_number_that_json_writes_is_one_number():
    assert NUMBER.findall(json.dumps([1e-7, 0.25, 7])) == ["1e-07", "0.25", "7"]
