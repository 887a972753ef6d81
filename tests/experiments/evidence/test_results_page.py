"""The published figures: every number of the page and the README is in the file."""

import json
import re

import pytest

from experiments.cli.app import app
from experiments.comparison.compare import Line
from experiments.comparison.location import Interval
from experiments.comparison.table import cells, header
from experiments.evidence.document import document
from experiments.evidence.headline import headline
from experiments.evidence.published_sweeps import published_names
from tests.docs.documents import ROOT, TEXTS

NUMBER = re.compile(r"\d+(?:\.\d+)*(?:e[+-]?\d+)?")
QUOTED = re.compile(r"<!-- results -->\n(.*?)\n<!-- end of results -->", re.DOTALL)
CODE = re.compile(
    r"^```.*?^```|^    .*?$|`[^`\n]*`|\]\([^)]*\)", re.DOTALL | re.MULTILINE
)
# of versions, a picture and an example: nothing that was measured
UNMEASURED = {"3.11", "2.0", "25", "140"}
DATA = (ROOT / "docs/results.json").read_text(encoding="utf-8")
PAGE, README = TEXTS["docs/results.md"], TEXTS["README.md"]


@pytest.fixture(scope="module")
def numbers():
    return json.loads(DATA)


def foreign_numbers(text: str) -> set[str]:
    """Numbers of a text that stand nowhere in the numbers file."""
    return set(NUMBER.findall(text)) - set(NUMBER.findall(DATA))


def test_every_number_of_the_page_is_in_the_numbers_file():
    words = PAGE.replace("95 % interval", "")
    assert foreign_numbers(words) == set()
    assert foreign_numbers(f"{words} 31.4159") == {"31.4159"}


def test_the_page_is_what_the_numbers_file_gives(numbers):
    assert document(numbers) == PAGE


def test_the_page_says_which_sweeps_are_of_another_version(numbers):
    def of(*codes):
        claims = [
            {**numbers["claims"][0], "name": f"sweep_{k}", "code": {"the code": code}}
            for k, code in enumerate(codes)
        ]
        return document({**numbers, "claims": claims})

    words = "Not one version of the code"
    assert words not in of("a" * 64, "a" * 64)
    other = of("a" * 64, "b" * 64, "a" * 64)
    assert "`sweep_0`, `sweep_2` with `aaaaaaaa`; `sweep_1` with `bbbbbbbb`" in other


def test_readme_quotes_the_headline(numbers):
    (quoted,) = QUOTED.findall(README)
    assert quoted == "\n\n".join(numbers["headline"])
    assert numbers["headline"] == headline(numbers["claims"])


def test_readme_has_no_other_measured_number():
    prose = CODE.sub(" ", QUOTED.sub(" ", README))
    assert set(NUMBER.findall(prose)) <= UNMEASURED
    assert foreign_numbers(QUOTED.findall(README)[0]) == set()


def test_tables_are_formatted_from_the_raw_lines(numbers):
    for claim in numbers["claims"]:
        lines = [read_line(one) for one in claim["lines"]]
        shown = [row for table in claim["tables"] for row in table["rows"]]
        metrics = list(dict.fromkeys(line.metric for line in lines))
        written = []
        for metric in metrics:
            own = [line for line in lines if line.metric == metric]
            names = header(own)
            kept = [
                number
                for number, name in enumerate(names)
                if name not in ("metric", "effect", "seeds")
            ]
            written += [[row[number] for number in kept] for row in cells(own)]
        assert all(row in written for row in shown)


def read_line(data: dict) -> Line:
    intervals = ("value", "difference", "placebo", "ahead")
    read = {
        key: Interval(
            of["value"],
            -float("inf") if of["low"] is None else of["low"],
            float("inf") if of["high"] is None else of["high"],
        )
        for key in intervals
        if (of := data[key]) is not None
    }
    return Line(**{**data, **read})


def test_the_published_run_is_on_published_seeds(numbers):
    first, last = numbers["published_seeds"]
    assert numbers["quick"] is False
    assert {claim["name"] for claim in numbers["claims"]} <= set(published_names())
    for claim in numbers["claims"]:
        assert first <= claim["seeds"]["first"] <= claim["seeds"]["last"] <= last
        reduced = claim["runs"] < claim["runs_of_the_file"]
        assert (f"**Reduced:** of `{claim['name']}`" in PAGE) == reduced


def test_the_simulated_statistics_hold(numbers):
    coverage, errors = numbers["statistics"]["tables"]
    assert numbers["statistics"]["repetitions"] == 2000
    for shape, ten, *others in coverage["rows"][:4]:
        assert all(93.5 <= float(share) <= 96.5 for share in others), shape
        assert 93.5 <= float(ten) <= 97.5, shape
    assert all(float(share) <= 5.0 for share in errors["rows"][0][1:])


@pytest.mark.slow
@pytest.mark.sumo
def test_quick_evidence_resumes(tmp_path, capsys):
    out = tmp_path / "evidence"
    asked = ["evidence", "lane_change_paired", "--quick", "--out", str(out)]
    for _ in range(2):
        app(asked, standalone_mode=False)
    said = capsys.readouterr().err
    assert said.count("statistics: computed") == 1
    assert said.count("statistics: kept from an earlier call") == 1
    numbers = json.loads((out / "results.json").read_text())
    assert [claim["name"] for claim in numbers["claims"]] == ["lane_change_paired"]
    assert (out / "results.md").read_text() == document(numbers)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--seeds", "200"], "--seeds 200: lane_change_ablation has 100"),
        (["road"], "road: no such published sweep"),
    ],
)
def test_bad_options_are_one_line(tmp_path, capsys, options, message):
    with pytest.raises(SystemExit) as ended:
        app(["evidence", *options, "--out", str(tmp_path / "evidence")])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "evidence").exists()
