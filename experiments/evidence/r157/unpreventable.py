"""Which cells of a panel each reference driver cannot prevent."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.cosim.conflicts import LateralProfile, Sizes
from experiments.evidence.r157.drivers import drivers_of
from experiments.evidence.r157.grids import ConflictPanel
from experiments.evidence.r157.simulate import ConflictEnd, simulate
from planner.reference_drivers import ReferenceDriver
from planner.states import BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class PanelResult:
    """One panel, and the cells in which each driver collided."""

    panel: ConflictPanel
    collided: Mapping[str, BoolArray]  # by driver, in the shape of the panel
    uncritical: Mapping[str, int]  # cells that a driver dismissed, by driver

    def count(self, name: str) -> int:
        """Return the number of cells that a driver cannot prevent."""
        return int(self.collided[name].sum())


def judge_panel(
    panel: ConflictPanel,
    drivers: Mapping[str, ReferenceDriver] | None = None,
    sizes: Sizes | None = None,
    profile: LateralProfile = LateralProfile.LINEAR,
) -> PanelResult:
    """Drive every reference driver through all cells of a panel.

    Each keeps its own distance to a leader.
    """
    collided, uncritical = {}, {}
    for name, model in (drivers or drivers_of(panel.kind)).items():
        results = simulate(model, panel.conflicts(model, sizes, profile))
        collided[name] = results.collided.reshape(panel.shape)
        uncritical[name] = int(np.sum(results.outcome == ConflictEnd.UNCRITICAL))
    return PanelResult(panel, collided, uncritical)


def counts_table(results: Iterable[PanelResult]) -> list[dict[str, int]]:
    """Return one row a panel: speeds, number of cells, unpreventable ones by driver."""
    return [
        {
            "ego_kmh": result.panel.ego_kmh,
            "other_kmh": result.panel.other_kmh,
            "cells": result.panel.cells,
            **{name: result.count(name) for name in result.collided},
        }
        for result in results
    ]
