"""The summary of the published sweeps: counts of a large claim, else its figures."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

from experiments.comparison.compare import named
from experiments.storage.markdown_table import markdown_table

Data = Mapping[str, Any]
MOST_FIGURES = 40  # of a summary that does not count
LEAST_SHARE = 0.25  # of a claim's runs, for a summary


def headline(claims: Sequence[Data]) -> list[str]:
    """Return the summary of the claims, in words and one table each.

    Those of which less than `LEAST_SHARE` was run stand in their own sections only;
    all are shown if none was run so far.
    """
    shown = [
        claim
        for claim in claims
        if claim["runs"] >= LEAST_SHARE * claim["runs_of_the_file"]
    ]
    return [words for claim in shown or claims for words in _headline(claim)]


def _headline(claim: Data) -> Iterator[str]:
    """Yield the summary of one claim."""
    rows = _figures(claim)
    counted = len(rows) * len(claim["tables"]) > MOST_FIGURES
    what = (
        "in how many roads and densities a planner is better than, worse than, or not "
        f"told apart from `{claim['baseline']}` (p (Holm) ≤ {claim['level']}, "
        if counted
        else f"each planner's figure, and its difference from `{claim['baseline']}` "
        f"with its interval (**bold**: p (Holm) ≤ {claim['level']}, "
    )
    seeds = claim["seeds"]
    yield (
        f"**{claim['name']}**, {claim['runs']} of {claim['runs_of_the_file']} runs, "
        f"seeds {seeds['first']} to {seeds['last']}: {what}{claim['tests']} tests):"
    )
    if "outcomes" in claim:  # what was written before has none
        yield "; ".join(starmap(_outcome, claim["outcomes"].items())) + "."
    if counted:
        yield _counts(claim) if claim["findings"] else "Nothing could be tested."
    else:
        titles = [table["title"] for table in claim["tables"]]
        yield markdown_table(["where", "planner", *titles], rows)


def _outcome(planner: str, statuses: Mapping[str, int]) -> str:
    """Say how the runs of a planner ended, the most frequent first."""
    ends = sorted(statuses.items(), key=lambda end: -end[1])
    words = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in ends)
    return f"`{planner}`: {words}"


def _counts(claim: Data) -> str:
    """Return the table of how often each planner is better and worse."""
    metrics = list(dict.fromkeys(one["metric"] for one in claim["findings"]))
    planners = list(dict.fromkeys(one["planner"] for one in claim["findings"]))
    found = {(one["planner"], one["metric"]): one for one in claim["findings"]}
    head = ["better / worse / undecided", *(named(metric) for metric in metrics)]
    rows = [
        [f"`{planner}`", *(_count(found.get((planner, metric))) for metric in metrics)]
        for planner in planners
    ]
    return markdown_table(head, rows)


def _count(finding: Data | None) -> str:
    """Format one entry of the counts."""
    if finding is None:
        return "not tested"
    return " / ".join(str(finding[key]) for key in ("better", "worse", "undecided"))


def _figures(claim: Data) -> list[list[str]]:
    """Return a row for each planner but the baseline, in each cell of the claim."""
    tables = [
        {
            (line.get("where", ""), line["planner"]): _figure(line, claim["level"])
            for row in table["rows"]
            if (line := dict(zip(table["header"], row, strict=True)))
        }
        for table in claim["tables"]
    ]
    keys = dict.fromkeys(key for table in tables for key in table)
    return [
        [where, f"`{planner}`", *(table.get((where, planner), "") for table in tables)]
        for where, planner in keys
        if planner != claim["baseline"]
    ]


def _figure(line: Data, level: float) -> str:
    """Format the value of a line, and its difference from the baseline."""
    value, difference = line["value"], line.get("difference", "")
    if not difference:
        return str(value)
    p = line.get("p (Holm)", "")
    found = f"{difference} {line['95 % interval of it']}"
    small = bool(p) and (p.startswith("<") or float(p) <= level)
    return f"{value}; **{found}**" if small else f"{value}; {found}"
