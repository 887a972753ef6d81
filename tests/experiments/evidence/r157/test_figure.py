import numpy as np

from experiments.evidence.r157.figure import _borders, draw_panels
from experiments.evidence.r157.grids import Density, cut_in_panel
from experiments.evidence.r157.unpreventable import judge_panel


def test_border_of_one_cell_is_its_square():
    inside = np.zeros((3, 2), dtype=bool)
    inside[1, 0] = True
    upright, level = _borders(inside, np.arange(4.0), np.arange(3.0))
    np.testing.assert_array_equal(upright[0], [1, 1, np.nan, 2, 2, np.nan])
    np.testing.assert_array_equal(upright[1], [0, 1, np.nan, 0, 1, np.nan])
    np.testing.assert_array_equal(level[0], [1, 2, np.nan, 1, 2, np.nan])
    np.testing.assert_array_equal(level[1], [0, 0, np.nan, 1, 1, np.nan])


def test_figure_has_one_panel_a_pair_and_one_area_of_the_human():
    pairs = ((60, 20), (90, 40), (110, 100))
    results = [judge_panel(cut_in_panel(*pair, Density.THINNED)) for pair in pairs]
    figure = draw_panels(results)
    figure.draw_without_rendering()
    titles = [axis.get_title() for axis in figure.axes]
    assert titles == [f"Ve {ve}, Vo {vo} km/h" for ve, vo in pairs]
    for axis, result in zip(figure.axes, results, strict=True):
        area = np.ma.compressed(axis.collections[0].get_array())
        assert np.nansum(area) == result.count("careful_human")
