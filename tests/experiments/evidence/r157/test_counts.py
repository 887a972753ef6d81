from dataclasses import replace

import numpy as np
import pytest

from experiments.evidence.r157.drivers import DRIVERS
from experiments.evidence.r157.grids import Density, cut_in_panel
from experiments.evidence.r157.unpreventable import counts_table, judge_panel

# Cells that cannot be prevented, of the published implementation of [Mattas2022] on
# the thinned grids: fuzzy safety model, careful human, RSS, 5.2.5.2.
REFERENCE = {
    (60, 20): (25, 92, 26, 58),
    (60, 50): (6, 34, 3, 19),
    (50, 10): (25, 92, 26, 58),
    (40, 10): (19, 73, 21, 45),
    (90, 40): (16, 63, 17, 38),
    (130, 70): (22, 73, 23, 49),
}
# First and last dx0 [m] that collides at 60/20 km/h, for Vy 0.4, 0.8, 1.2, 1.6 m/s; 1.2
# as a number of its own, not 12 times 0.1, with which the ramp takes a step longer.
REFERENCE_RANGES = {
    "fuzzy_safety": (None, (13, 19), (7, 17), (4, 15)),
    "careful_human": ((36, 59), (14, 40), (7, 33), (4, 30)),
    "rss": ((17, 17), (10, 16), (6, 14), (3, 13)),
    "regulation_157": ((35, 45), (14, 29), (7, 25), (4, 21)),
}


@pytest.mark.parametrize("speeds", REFERENCE)
def test_counts_are_those_of_the_published_code(speeds):
    result = judge_panel(cut_in_panel(*speeds, Density.THINNED))
    counts = [result.count(name) for name in DRIVERS]
    assert tuple(counts) == REFERENCE[speeds]


@pytest.mark.parametrize("name", REFERENCE_RANGES)
def test_ranges_are_those_of_the_published_code(name):
    panel = cut_in_panel(60, 20)
    panel = replace(panel, y=np.round(panel.y, 1))
    collided = judge_panel(panel, {name: DRIVERS[name]}).collided[name]
    for column, reference in zip((4, 8, 12, 16), REFERENCE_RANGES[name], strict=True):
        gaps = panel.x[collided[:, column]]
        assert (reference is None) == (gaps.size == 0)
        if reference is not None:
            np.testing.assert_array_equal(
                gaps, np.arange(reference[0], reference[1] + 1)
            )


def test_only_the_speed_difference_matters_to_driver_and_formula():
    a, b = (judge_panel(cut_in_panel(*pair)) for pair in ((60, 20), (50, 10)))
    for name in ("careful_human", "regulation_157"):
        np.testing.assert_array_equal(a.collided[name], b.collided[name])


def test_table_has_one_row_a_panel():
    panel = cut_in_panel(60, 50, Density.THINNED)
    assert counts_table([judge_panel(panel)]) == [
        {
            "ego_kmh": 60,
            "other_kmh": 50,
            "cells": 270,
            "fuzzy_safety": 6,
            "careful_human": 34,
            "rss": 3,
            "regulation_157": 19,
        }
    ]
