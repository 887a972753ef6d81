"""The numbers of a study: collisions a careful human would have prevented, and more."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from experiments.cosim.conflicts import LateralProfile
from experiments.evidence.r157.drivers import CAREFUL_HUMAN, drivers_of
from experiments.evidence.r157.grids import (
    KMH,
    ConflictKind,
    ConflictPanel,
    Density,
    panels_of,
)
from experiments.evidence.r157.planner_runs import ACTUATORS, RunSettings
from experiments.evidence.r157.study import PlannerPanel, run_panel
from experiments.evidence.r157.unpreventable import PanelResult, judge_panel
from experiments.sweep.processes.parallel import Work
from planner.reference_drivers.situation import GRAVITY

SCENARIOS: Final[Mapping[ConflictKind, str]] = {
    ConflictKind.CUT_IN: "cut_in",
    ConflictKind.CUT_OUT: "cut_out",
    ConflictKind.BRAKING: "braking_leader",
}
X_NAMES: Final[Mapping[ConflictKind, str]] = {
    ConflictKind.CUT_IN: "dx0 [m]",
    ConflictKind.CUT_OUT: "dx0_f [m]",
    ConflictKind.BRAKING: "speed [km/h]",
}
Y_NAMES: Final[Mapping[ConflictKind, str]] = {
    ConflictKind.CUT_IN: "Vy [m/s]",
    ConflictKind.CUT_OUT: "Vy [m/s]",
    ConflictKind.BRAKING: "deceleration [g]",
}


@dataclass(frozen=True, slots=True)
class Headline:
    """What a planner did in all panels of a kind."""

    planner: str
    cells: int
    collisions: int
    preventable: int  # of these, in cells that the careful human prevents
    unpreventable: int  # cells that the careful human does not prevent
    survived: int  # of these, without a collision
    failed: int
    left_lane: int
    braked_hard: int
    hardest_braking: float  # [m/s²]
    follower_braking: float  # hardest [m/s²]
    follower_hits: int

    @property
    def share(self) -> str:
        """Share of the careful human's collisions that the planner survives."""
        if not self.unpreventable:
            return "-"
        return f"{100.0 * self.survived / self.unpreventable:.0f} %"


@dataclass(frozen=True, slots=True, eq=False)
class KindStudy:
    """All results of one kind of conflict."""

    kind: ConflictKind
    results: Sequence[PanelResult]
    runs: Mapping[str, Sequence[PlannerPanel]]  # by planner

    def headlines(self) -> list[Headline]:
        """Return the headline of every planner."""
        return [headline(self.results, runs) for runs in self.runs.values()]


def headline(results: Sequence[PanelResult], runs: Sequence[PlannerPanel]) -> Headline:
    """Sum up the runs of one planner; both sequences are in the order of the panels."""
    human = [result.collided[CAREFUL_HUMAN] for result in results]
    hit = [run.collided for run in runs]
    pairs = list(zip(human, hit, strict=True))

    def most(name: str) -> float:
        return max(float(np.max(run.table[name])) for run in runs)

    return Headline(
        runs[0].planner,
        sum(run.panel.cells for run in runs),
        sum(int(cells.sum()) for cells in hit),
        sum(int((cells & ~grey).sum()) for grey, cells in pairs),
        sum(int(grey.sum()) for grey in human),
        sum(int((grey & ~cells).sum()) for grey, cells in pairs),
        sum(int(run.failed.sum()) for run in runs),
        sum(int(run.left_lane.sum()) for run in runs),
        sum(int(run.braked_hard.sum()) for run in runs),
        most("hardest_braking_mps2"),
        most("follower_braking_mps2"),
        sum(int(np.sum(run.table["follower_hit"])) for run in runs),
    )


def preventable_cells(
    results: Sequence[PanelResult],
    runs: Sequence[PlannerPanel],
    settings: RunSettings,
) -> list[dict[str, Any]]:
    """Return the cells in which a planner collided and the careful human does not.

    Args:
        results: Of the reference drivers.
        runs: Of one planner, in the same order.
        settings: Of the runs, for the commands that replay them.
    """
    found: list[dict[str, Any]] = []
    for result, run in zip(results, runs, strict=True):
        panel = result.panel
        cells = run.collided & ~result.collided[CAREFUL_HUMAN]
        for i, j in np.argwhere(cells).tolist():
            x, y = round(float(panel.x[i]), 3), round(float(panel.y[j]), 3)
            impact = round(float(run.cells("impact_speed_mps")[i, j]), 1)
            found.append(
                {
                    "planner": run.planner,
                    "panel": panel.title,
                    X_NAMES[panel.kind]: x,
                    Y_NAMES[panel.kind]: y,
                    "impact [m/s]": impact,
                    "replay": _replay(panel, run.planner, (x, y), settings),
                }
            )
    return found


def _replay(
    panel: ConflictPanel,
    planner: str,
    cell: tuple[float, float],
    settings: RunSettings,
) -> str:
    """Return the command that drives one cell with a whole trace and a page."""
    x, y = cell
    kmh = x if panel.kind is ConflictKind.BRAKING else panel.ego_kmh
    keys: dict[str, float | str] = {"ego.target_speed_mps": kmh * KMH}
    if panel.kind is ConflictKind.BRAKING:
        keys["conflict.deceleration_mps2"] = y * GRAVITY
    else:
        keys |= {"conflict.gap_m": x, "conflict.lateral_speed_mps": y}
    if panel.kind is ConflictKind.CUT_IN:
        keys["conflict.other_speed_mps"] = panel.other_kmh * KMH
    driver = drivers_of(panel.kind).get(planner)
    if driver is not None and panel.kind is not ConflictKind.CUT_IN:
        speed = np.array([kmh * KMH])
        keys["conflict.following_gap_m"] = float(driver.following_gap(speed)[0])
    if panel.kind is ConflictKind.CUT_IN and settings.profile != LateralProfile.LINEAR:
        keys["conflict.profile"] = str(settings.profile)
    if settings.follower:
        keys["conflict.follower"] = "true"
    if settings.plant is not None:
        keys |= {"ego.plant": str(settings.plant.model), "ego.actuators": ACTUATORS}
    words = " ".join(f"--set {key}={_written(value)}" for key, value in keys.items())
    return f"rearview run {SCENARIOS[panel.kind]} --planner {planner} {words}"


def _written(value: float | str) -> str:
    """Write the value of a key."""
    return value if isinstance(value, str) else f"{value:.6g}"


def counts_rows(
    results: Sequence[PanelResult], runs: Mapping[str, Sequence[PlannerPanel]]
) -> list[dict[str, Any]]:
    """Return one row a panel: cells, collisions of every driver and planner."""
    rows = []
    for k, result in enumerate(results):
        row: dict[str, Any] = {"panel": result.panel.title, "cells": result.panel.cells}
        row |= {name: result.count(name) for name in result.collided}
        row |= {name: int(found[k].collided.sum()) for name, found in runs.items()}
        rows.append(row)
    totals: dict[str, Any] = {"panel": "all"}
    totals |= {
        name: sum(row[name] for row in rows) for name in rows[0] if name != "panel"
    }
    return [*rows, totals]


def study_kind(
    kind: ConflictKind,
    planners: Sequence[str],
    density: Density,
    settings: RunSettings,
    folder: Path,
    work: Work,
) -> KindStudy:
    """Drive planners and reference drivers through all panels of a kind.

    Finished panels are kept in the folder; see `run_panel`.
    """
    panels = panels_of(kind, density)
    runs = {
        name: [run_panel(name, panel, settings, folder, work) for panel in panels]
        for name in planners
    }
    profile = settings.profile
    judged = [judge_panel(panel, profile=profile) for panel in panels]
    return KindStudy(kind, judged, runs)
