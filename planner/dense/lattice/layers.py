"""Where the layers of the adaptive method lie along s; [Thesis] 5.4.1."""

import math

import numpy as np

from planner.dense.settings import LatticeSettings, LayerRule
from planner.states import FloatArray, IntArray

MIN_GAP = 1.0  # a layer nearer than this to the ego or the end would be no layer [m]


def layers(
    beside: FloatArray, s_start: float, s_end: float, settings: LatticeSettings
) -> tuple[FloatArray, IntArray]:
    """Place the layers along s; [Thesis] eq. 5.4, with the ego and the end.

    Args:
        beside: Where the ego is beside each obstacle, in growing order, (n,) [m].
        s_start: Where the ego is [m].
        s_end: Where the last layer is [m].
        settings: Rule, step and merging distance.

    Returns:
        (s in growing order, (n_layers,) [m]; 1 where obstacles set the layer, else 0).
    """
    ahead = (beside > s_start + MIN_GAP) & (beside < s_end - MIN_GAP)
    marks = merged(beside[ahead], settings.merge_distance)
    s: list[float] = []
    set_by_obstacle: list[int] = []
    last = s_start
    for mark in (*marks, s_end):
        between = gap_layers(last, mark, settings)
        s += [*between, mark]
        set_by_obstacle += [0] * len(between) + [1]
        last = mark
    set_by_obstacle[-1] = 0
    return np.array(s), np.array(set_by_obstacle)


def merged(marks: FloatArray, distance: float) -> list[float]:
    """Replace each chain of marks that reaches at most `distance` by its mean."""
    groups: list[list[float]] = []
    for mark in marks.tolist():
        if groups and mark - groups[-1][0] <= distance:
            groups[-1].append(mark)
        else:
            groups.append([mark])
    return [sum(group) / len(group) for group in groups]


def gap_layers(start: float, end: float, settings: LatticeSettings) -> list[float]:
    """Place the layers inside one gap, its ends left out."""
    gap, step = end - start, settings.layer_step
    if settings.layer_rule is LayerRule.PRINTED:
        n = math.ceil(gap / step - 1e-9) - 1
        return [start + step * i for i in range(1, n + 1)]
    parts = math.floor(gap / step + 1e-9)
    return [start + gap * i / parts for i in range(1, parts)]
