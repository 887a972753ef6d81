"""Random episodes: none ends in a traceback, and each says rightly how it ended.

`pytest tests/experiments/episodes/test_campaign.py -m slow -n0 -s --episodes 500` runs
the large campaign and prints who arrives, and the command of every other episode.
"""

import json
import traceback
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import pytest
from pebble import ProcessExpired, ProcessPool

from experiments.config.scenario_file import load_scenario
from experiments.cosim.records import EpisodeStatus
from experiments.episode.run import run_episode
from experiments.errors import ConfigError
from experiments.report.run.page import save_run_page
from tests.experiments.episodes.ending_checks import problems
from tests.experiments.episodes.random_scenarios import random_episode

WORKERS = 2
PATIENCE = 600.0  # with one episode [s]
REFUSED = "refused"  # no such course among so many obstacles: another is to be drawn
PICTURED = 3  # in every so many episodes the page is written too


def drive(seed: int, out: Path) -> dict[str, object]:
    """Drive the episode of a seed and check its ending."""
    episode = random_episode(seed)
    row = {**asdict(episode), "command": episode.command, "problems": []}
    try:
        scenario = load_scenario(
            episode.name,
            planner=episode.planner,
            seed=seed,
            overrides=episode.overrides,
        )
        outcome = run_episode(scenario, out=out)
    except ConfigError as error:
        found = [] if "course" in str(error) else ["is not allowed"]
        return {**row, "status": REFUSED, "reason": str(error), "problems": found}
    except Exception:  # noqa: BLE001, a traceback is what is looked for
        return {**row, "status": "traceback", "problems": [traceback.format_exc()]}
    ending = outcome.ending
    found = list(problems(scenario, ending, outcome.trace))
    if ending.status is EpisodeStatus.NO_ROOM:
        empty = load_scenario(
            episode.name, planner=episode.planner, overrides=["traffic=none"]
        )
        if run_episode(empty, out=out).ending.status is EpisodeStatus.NO_ROOM:
            found.append("nor is there room on an empty road")
    if seed % PICTURED == 0:
        save_run_page(outcome.folder)
    return {
        **row,
        "status": str(ending.status),
        "reason": ending.reason,
        "problems": found,
    }


def campaign(count: int, out: Path) -> list[dict[str, object]]:
    """Drive the first episodes, each death of a process costing one of them."""
    rows = []
    with ProcessPool(WORKERS) as pool:
        waiting = [
            (seed, pool.schedule(drive, (seed, out), timeout=PATIENCE))
            for seed in range(count)
        ]
        with (out / "episodes.jsonl").open("w") as log:
            for seed, future in waiting:
                try:
                    row = future.result()
                except (ProcessExpired, TimeoutError) as error:
                    row = {**asdict(random_episode(seed)), "status": "died"}
                    row |= {"command": random_episode(seed).command}
                    row |= {"reason": repr(error), "problems": [repr(error)]}
                rows.append(row)
                log.write(json.dumps(row) + "\n")
                log.flush()
    return rows


def summary(rows: list[dict[str, object]]) -> str:
    """Arrivals by body and by planner and scenario, then all that did not arrive."""
    lines = []
    for keys in (("body",), ("name", "body"), ("name", "planner")):
        groups: dict[tuple[object, ...], Counter[object]] = {}
        for row in rows:
            group = tuple(row[key] for key in keys)
            groups.setdefault(group, Counter())[row["status"]] += 1
        for group, counts in sorted(groups.items()):
            words = ", ".join(f"{status} {n}" for status, n in counts.most_common())
            lines.append(f"{' '.join(map(str, group))}: {words}")
    lines.extend(
        f"{row['status']} ({row['body']}): {row['reason']}\n  {row['command']}"
        for row in rows
        if row["status"] != EpisodeStatus.ARRIVED
    )
    return "\n".join(lines)


@pytest.mark.slow
@pytest.mark.sumo
def test_every_random_episode_ends_for_the_reason_that_it_gives(tmp_path, pytestconfig):
    count = pytestconfig.getoption("--episodes")
    rows = campaign(count, tmp_path)
    print(f"\n{summary(rows)}")  # noqa: T201 - what this test is run for
    wrong = {row["command"]: row["problems"] for row in rows if row["problems"]}
    assert wrong == {}
    driven = [row for row in rows if row["status"] != REFUSED]
    # the printed chapter 6 is known to fail: no share of arrivals is asked of it
    asked = [row for row in driven if row["planner"] != "lane_change_thesis"]
    cars = [row for row in asked if row["body"] == "car"]
    assert len(driven) >= 0.9 * count
    arrived = sum(row["status"] == EpisodeStatus.ARRIVED for row in cars)
    assert arrived >= 0.8 * len(cars)
