"""The document `results.md`, written from the numbers file and nothing else."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from experiments.storage.markdown_table import markdown_table

Data = Mapping[str, Any]

INTRODUCTION = """# Results

What was measured, and how far it can be trusted. `make results` writes this file; every
number in it stands in `results.json` beside it, with all that the tables leave out, and
nothing is typed in by hand. The summary at the top leaves out sweeps of which less than
a quarter was driven. What the thesis claims, and what holds, has
[its own page](thesis.md); times are in [Performance](performance.md)."""

READING = """## How to read the tables

All planners drive the same seeds. *value* is the mean over the seeds, or the share of
runs; *difference* is that from the baseline, over the *pairs* of seeds that both have a
value for, and what shares a seed is averaged first. *placebo* is the same figure of two
runs **without** an ego: what SUMO's random numbers alone make of it; *far ahead* is
that of vehicles which the ego cannot reach. A figure of the cost to others that is not
clearly above both shows nothing.

*p* and the interval beside it come from the same tests: of means, Student's t and the
studentised bootstrap, the larger p and the wider interval; of shares, Tango's score and
McNemar's exact test. *p (Holm)* is corrected for all tests of a claim, over all roads
and densities; the metrics of a claim are fixed in its sweep file before it is run. A
metric in which no pair differs, and wall-clock times, are not tested. Where an ego did
not arrive, the travel time of the pairs in which both did is shown without a test, and
a penalised one takes its place. Of an event that was never seen, the rule of three
gives the rate that is still likely."""


def document(numbers: Data) -> str:
    """Write the whole document."""
    parts = [INTRODUCTION, _effort(numbers), *numbers["headline"]]
    parts += [READING, _seeds(numbers)]
    for claim in numbers["claims"]:
        parts += _claim(claim)
    parts += _layouts(numbers["layouts"])
    parts += _statistics(numbers["statistics"])
    return "\n\n".join(part for part in parts if part) + "\n"


def _effort(numbers: Data) -> str:
    """Say how much was run, and whether that is all."""
    words = []
    if numbers["quick"]:
        words.append("Computed with `--quick`: one seed of one road, no evidence.")
    words += [
        f"**Reduced:** of `{claim['name']}` {claim['runs']} of "
        f"{claim['runs_of_the_file']} runs were made, with {claim['seeds']['count']} "
        f"of {claim['seeds_of_the_file']} seeds."
        for claim in numbers["claims"]
        if claim["runs"] < claim["runs_of_the_file"]
    ]
    return " ".join([*words, *_codes(numbers["claims"])])


def _codes(claims: Sequence[Data]) -> list[str]:
    """Say which sweeps were run with which code, if not all with the same."""
    names: dict[str, list[str]] = {}
    for claim in claims:
        code = str(claim["code"]["the code"])[:8]
        names.setdefault(code, []).append(f"`{claim['name']}`")
    if len(names) <= 1:
        return []
    each = "; ".join(f"{', '.join(of)} with `{code}`" for code, of in names.items())
    return [f"**Not one version of the code:** {each} (hash of the sources)."]


def _seeds(numbers: Data) -> str:
    """Say which seeds were used for what."""
    tuned, published = numbers["development_seeds"], numbers["published_seeds"]
    return (
        f"Planners are tuned on seeds {tuned[0]} to {tuned[1]}. The sweeps below use "
        f"seeds from {published[0]} to {published[1]}, on which nothing was tuned; a "
        "published sweep with seeds of the first range is refused."
    )


def _claim(claim: Data) -> Iterator[str]:
    """Yield the section of a sweep."""
    yield f"## {TITLES.get(claim['name'], claim['name'])}"
    yield claim["purpose"]
    statuses = ", ".join(f"{n} {name}" for name, n in claim["statuses"].items())
    yield f"{claim['runs']} runs: {statuses}."
    for table in claim["tables"]:
        yield f"### {_anchored(claim, table)}"
        yield markdown_table(table["header"], table["rows"])
    yield f"```sh\nrearview sweep {claim['name']}\n```"


def _anchored(claim: Data, table: Data) -> str:
    """Return the heading of a table; headings of a page have to differ."""
    return f"{table['title']} (`{claim['name']}`)"


TITLES: Mapping[str, str] = {
    "lane_change_fair": "One question, one opponent at its best",
    "lane_change_paired": "Lane changes",
    "lane_change_ablation": "Parts of the lane-change planner",
}


def _layouts(layouts: Data) -> Iterator[str]:
    """Yield the section on random layouts of obstacles."""
    yield "## Dense obstacles"
    yield (
        f"{layouts['layouts']} random layouts of obstacles a row, "
        f"{layouts['in_all']} in all, by the methods of [Dense "
        "obstacles](planners/dense.md), on the road of the thesis. `python -m "
        "experiments.thesis.dense.methods` prints more of them."
    )
    for table in layouts["tables"]:
        yield f"### {table['title']}"
        yield markdown_table(table["header"], table["rows"])


def _statistics(found: Data) -> Iterator[str]:
    """Yield the section on the procedures themselves."""
    yield "## The statistics, simulated"
    yield (
        f"{found['repetitions']} repetitions of each entry, with the procedures that "
        "made the tables above. A claim of the second table has "
        f"{found['planners']} planners beside the baseline, {found['cells']} roads and "
        "densities, one metric of each shape that is named, and one rate of "
        f"{found['event_rate']}; at most {found['level']} of the claims should have a "
        "finding. The last row of each table is the limit: of very skewed differences "
        "the intervals of few pairs are too short, and claims about nothing but "
        "differences that are mostly zero and else skewed err more often."
    )
    for table in found["tables"]:
        yield f"### {table['title']}"
        yield markdown_table(table["header"], table["rows"])
