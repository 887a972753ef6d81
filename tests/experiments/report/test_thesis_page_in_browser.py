"""The page of the thesis in a real browser: contents, and claims of one verdict."""

import json
from pathlib import Path

import pytest

from experiments.thesis.page import thesis_page
from tests.experiments.report.browser import fits, violations
from tests.experiments.report.conftest import NARROW, WIDE

pytestmark = [pytest.mark.slow, pytest.mark.browser]

NUMBERS = Path(__file__).parents[3] / "docs/thesis.json"


@pytest.fixture(scope="module")
def thesis(tmp_path_factory):
    numbers = json.loads(NUMBERS.read_text(encoding="utf-8"))
    pictures = {chapter["number"]: [] for chapter in numbers["chapters"]}
    file = tmp_path_factory.mktemp("thesis") / "report.html"
    file.write_text(thesis_page(numbers, pictures), encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("size", "scheme"), [(WIDE, "light"), (NARROW, "dark")], ids=["wide", "narrow"]
)
def test_claims_are_filtered_and_chapters_found(thesis, show, size, scheme):
    page = show(thesis, size, scheme).page
    assert fits(page, size)
    rows = page.locator("tr[data-verdict]")
    total = rows.count()
    page.locator("#verdicts").select_option("does not hold")
    shown = page.locator("tr[data-verdict]:visible")
    kinds = {row.get_attribute("data-verdict") for row in shown.all()}
    assert kinds == {"does not hold"}
    assert page.locator("#shown").inner_text() == f"{shown.count()} of {total} claims"
    page.locator("#verdicts").select_option("")
    assert page.locator("tr[data-verdict]:visible").count() == total
    page.locator("nav a[href='#chapter-6']").click()
    top = page.locator("#chapter-6").bounding_box()["y"]
    assert 0 <= top < 250
    assert violations(page, ("serious", "critical")) == []
