"""The table of `commonroad.md`: scenarios driven, solved, and officially checked.

`python -m experiments.evidence.commonroad_study -o docs/commonroad.md` drives the
shipped scenarios, and those exported from runs in SUMO; what is finished is kept
until the code, the scenario or its file changes.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.commonroad.checker import check_solution, find_python
from experiments.commonroad.read import read_commonroad
from experiments.commonroad.solution import CostFunction
from experiments.commonroad.write import write_commonroad
from experiments.config import Scenario
from experiments.config.scenario_file import config_hash, load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.episode.commonroad_export import exported_scenario
from experiments.episode.commonroad_solution import read_solved_run, solution_of
from experiments.episode.run import run_episode
from experiments.errors import ExperimentError
from experiments.evidence.document_command import write_document
from experiments.evidence.quote import quoted
from experiments.storage.atomic_folder import make_folder, write_atomically
from experiments.storage.provenance import code_hash, file_hash

OUT = Path("runs/commonroad")
SHIPPED = Path(__file__).parents[1] / "scenarios" / "commonroad"
ROADS = (
    "straight",
    "curved",
    "u_shaped",
    "intersection",
    "t_junction",
    "stop_sign",
    "all_way_stop",
    "right_before_left",
    "unprotected_left",
    "left_hand",
    "roundabout",
    "lane_change",
    "lane_drop",
    "on_ramp",
)
SEEDS = (1, 2, 3)
REFUSED = "refused"  # by the reader or the solution, with its line as the reason
SHIPPED_ROW = "shipped"
MADE_OF = "made_of"  # key of a result: what it is computed anew for


def study(out: Path, python: Path) -> Iterator[Mapping[str, Any]]:
    """Yield what came of each scenario, in the order of the table.

    Args:
        out: Folder of exported scenarios, runs and results.
        python: Of the checker's environment.
    """
    for file in sorted(SHIPPED.glob("*.xml")):
        yield _kept(out / f"{file.stem}.json", SHIPPED_ROW, file, out, python)
    for road in ROADS:
        for seed in SEEDS:
            stem = f"{road}_{seed}"
            result = out / f"{stem}.json"
            file = out / f"{stem}.xml"
            scenario = load_scenario(road, overrides=(f"simulation.seed={seed}",))
            recorded = config_hash(scenario.resolved())
            if not is_current(result, made_of(file, recorded)):
                write_commonroad(_export(scenario, out), file)
            yield _kept(result, road, file, out, python, recorded=recorded)


def made_of(file: Path, recorded: str = "") -> Mapping[str, str]:
    """Hash what a result is made of: the code, the file, and the run it is of.

    Args:
        file: Of the scenario; it need not be there.
        recorded: Hash of the scenario of the run in SUMO; empty without one.
    """
    content = file_hash(file) if file.is_file() else ""
    return {"code": code_hash(), "file": content, "recorded": recorded}


def is_current(result: Path, parts: Mapping[str, str]) -> bool:
    """Check whether a kept result is made of what is there now."""
    if not result.exists():
        return False
    return bool(json.loads(result.read_text(encoding="utf-8")).get(MADE_OF) == parts)


def _export(scenario: Scenario, out: Path) -> Any:
    """Drive a shipped scenario in SUMO, and turn the run into one of CommonRoad."""
    return exported_scenario(run_episode(scenario, out=out / "recorded").folder)


def _kept(
    result: Path,
    group: str,
    file: Path,
    out: Path,
    python: Path,
    *,
    recorded: str = "",
) -> Mapping[str, Any]:
    """Return the result of a scenario, computed if it is not that of the present."""
    parts = made_of(file, recorded)
    if is_current(result, parts):
        found: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
        return found
    try:
        found = {"group": group, "file": file.name, **_driven(file, out, python)}
    except ExperimentError as error:
        reason = f"{error}"
        found = {"group": group, "file": file.name, "status": REFUSED, "reason": reason}
    found[MADE_OF] = parts
    write_atomically(result, json.dumps(found, indent=1))
    return found


def _driven(file: Path, out: Path, python: Path) -> dict[str, Any]:
    """Drive a scenario; ask the official checker if it is solved."""
    read_commonroad(file)
    outcome = run_episode(load_scenario(str(file)), out=out / "driven")
    found = {"status": outcome.ending.status.value, "reason": outcome.ending.reason}
    if outcome.ending.status is not EpisodeStatus.ARRIVED:
        return found
    text, missing = solution_of([read_solved_run(outcome.folder)], CostFunction.SM1)
    solution = outcome.folder / "solution.xml"
    solution.write_text(text, encoding="utf-8")
    report = check_solution(file, solution, python)
    wrong = [f"{name}: {words}" for name, words in report.checks.items() if words]
    return {
        **found,
        "accepted": report.is_accepted and not missing,
        "wrong": wrong,
        "cost": report.cost,
    }


def table(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Write the table and what went wrong, as paragraphs of Markdown."""
    lines = [
        "| scenarios | driven | solved | collided | accepted of the solved |",
        "|---|---|---|---|---|",
    ]
    groups = dict.fromkeys(str(one["group"]) for one in results)
    lines += [_row(x, [one for one in results if one["group"] == x]) for x in groups]
    exported = [x for x in results if x["group"] != SHIPPED_ROW]
    lines.append(_row("all exported", exported))
    failures = [
        f"- `{one['file']}`: {one['status']}: {one['reason']}"
        for one in results
        if one["status"] != EpisodeStatus.ARRIVED
    ]
    failures += [
        f"- `{one['file']}`: not accepted: {'; '.join(one['wrong'])}"
        for one in results
        if not one.get("accepted", True)
    ]
    words = "Those that were not solved, or not accepted:" if failures else ""
    return ["\n".join(lines), *([words, "\n".join(failures)] if failures else [])]


def _row(group: str, results: Sequence[Mapping[str, Any]]) -> str:
    """Write the line of a group."""
    solved = [x for x in results if x["status"] == EpisodeStatus.ARRIVED]
    hit = sum(x["status"] == EpisodeStatus.COLLISION for x in results)
    driven = sum(x["status"] != REFUSED for x in results)
    accepted = sum(bool(x["accepted"]) for x in solved)
    name = group if " " in group else f"`{group}`"
    cells = (name, f"{driven} of {len(results)}", str(len(solved)), str(hit))
    return f"| {' | '.join(cells)} | {accepted} of {len(solved)} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; see `write_document`."""
    parser = argparse.ArgumentParser(prog="commonroad_study", description=__doc__)
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the runs")
    return write_document(parser, _page, arguments)


def _page(options: argparse.Namespace) -> str:
    """Drive what is missing, and put the table into the page that is there."""
    python = find_python()
    make_folder(options.out)
    results = []
    for found in study(options.out, python):
        sys.stderr.write(f"{found['file']}: {found['status']}\n")
        results.append(found)
    text = options.output.read_text(encoding="utf-8")
    return quoted(text, table(results))


if __name__ == "__main__":
    sys.exit(main())
