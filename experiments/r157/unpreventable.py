"""Which cells of a panel each reference driver cannot prevent."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from experiments.r157.conflicts import Sizes
from experiments.r157.drivers import DRIVERS
from experiments.r157.grids import CutInPanel
from experiments.r157.simulate import simulate
from planner.reference_drivers import ReferenceDriver
from planner.states import BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class PanelResult:
    """One panel, and the cells in which each driver collided."""

    panel: CutInPanel
    collided: Mapping[str, BoolArray]  # by driver, (n_gaps, n_lateral_speeds)

    def count(self, name: str) -> int:
        """Return the number of cells that a driver cannot prevent."""
        return int(self.collided[name].sum())


def judge_panel(
    panel: CutInPanel,
    drivers: Mapping[str, ReferenceDriver] = DRIVERS,
    sizes: Sizes | None = None,
) -> PanelResult:
    """Drive every reference driver through all cells of a panel."""
    conflicts = panel.conflicts(sizes)
    collided = {
        name: simulate(model, conflicts).collided.reshape(panel.shape)
        for name, model in drivers.items()
    }
    return PanelResult(panel, collided)


def counts_table(results: Iterable[PanelResult]) -> list[dict[str, int]]:
    """Return one row a panel: speeds, number of cells, unpreventable ones by driver."""
    return [
        {
            "ego_kmh": result.panel.ego_kmh,
            "other_kmh": result.panel.other_kmh,
            "cells": result.panel.gaps.size * result.panel.lateral_speeds.size,
            **{name: result.count(name) for name in result.collided},
        }
        for result in results
    ]
