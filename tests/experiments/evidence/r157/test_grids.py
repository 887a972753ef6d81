import numpy as np
import pytest

from experiments.errors import ConfigError
from experiments.evidence.r157.grids import (
    Density,
    braking_panel,
    cut_in_panel,
    cut_in_panels,
    cut_out_panel,
)


def test_full_grid_of_cut_ins():
    panels = cut_in_panels()
    assert len(panels) == 15 + 13
    cells = [p.x.size * p.y.size for p in panels]
    assert cells == [1062] * 15 + [1080] * 13


def test_thinned_panel_takes_every_second_value():
    panel = cut_in_panel(130, 70, Density.THINNED)
    np.testing.assert_array_equal(panel.x, np.arange(1.0, 118.0, 4.0))
    np.testing.assert_allclose(panel.y, np.arange(9) * 0.2)


def test_conflicts_are_in_the_order_of_the_cells():
    panel = cut_in_panel(60, 20, Density.THINNED)
    conflicts = panel.conflicts()
    start = conflicts.gap - (40.0 / 3.6) * 0.1 * conflicts.start
    np.testing.assert_allclose(
        start.reshape(panel.shape), np.repeat(panel.x[:, None], 9, axis=1)
    )


def test_grids_of_the_other_scenarios():
    assert cut_out_panel(60).conflicts().size == 30 * 15
    panel = braking_panel()
    assert panel.shape == (30, 19)
    conflicts = panel.conflicts()
    np.testing.assert_allclose(conflicts.gap, 2.0 * np.repeat(panel.x, 19) / 3.6)


@pytest.mark.parametrize(("ego", "other"), [(60, 60), (60, 70), (60, 0)])
def test_impossible_speeds_are_refused(ego, other):
    with pytest.raises(ConfigError, match="needs 0 < Vo < Ve"):
        cut_in_panel(ego, other)
