import math

import numpy as np
import pytest
from rich.console import Console

from experiments.thesis.dense.methods import (
    Measured,
    MethodPath,
    main,
    measure,
    path_metrics,
    random_table,
    share_better,
)
from planner.dense.frenet_path import FrenetPath


def test_metrics_of_a_cubic_agree_with_closed_forms():
    s = np.linspace(0.0, 10.0, 21)
    path = FrenetPath(s, 0.01 * s**3 / 6.0, 0.005 * s**2, 0.01 * s)
    length, heading, curvature, mean_l2, cost = path_metrics(path)
    fine = np.linspace(0.0, 10.0, 200_001)
    slope = 0.005 * fine**2
    bent = 0.01 * fine / (1.0 + slope**2) ** 1.5
    assert length == pytest.approx(np.trapezoid(np.hypot(1.0, slope), fine), rel=1e-5)
    assert heading == pytest.approx(math.atan(0.5))
    assert curvature == pytest.approx(bent.max(), rel=1e-4)
    squared = (0.01 / 6.0) ** 2 * 10.0**7 / 7.0  # integral of l²
    assert mean_l2 == pytest.approx(squared / 10.0, rel=1e-3)
    smooth = 0.005**2 * 1e5 / 5.0 + 1e-4 * 1e3 / 3.0 + 1e-4 * 10.0
    assert cost == pytest.approx(1000.0 * smooth + 100.0 * squared, rel=1e-3)


def straight_at(l):
    def method(field):
        s = np.linspace(0.0, 60.0, 5)
        return MethodPath(FrenetPath(s, np.full(5, l), np.zeros(5), np.zeros(5)), "ok")

    return method


def test_a_method_of_ones_own_can_be_compared():
    obstacles = np.array([[30.0, 4.0, 0.5]])
    rows = {
        name: [measure(name, straight_at(l), obstacles)]
        for name, l in (("near", 0.5), ("far", 2.0))
    }
    assert share_better(rows["near"], rows["far"], ("mean_l2", "thesis_cost")) == (1, 1)
    assert share_better(rows["near"], rows["far"], ("length",)) == (0, 1)
    failed = measure("none", lambda _: MethodPath(None, "blocked"), obstacles)
    assert not failed.solved
    assert math.isnan(failed.length)
    assert isinstance(failed, Measured)
    assert share_better(rows["near"], [failed], ("length",)) == (0, 0)
    rows["none"] = [failed]
    console = Console(width=100, record=True, quiet=True)
    console.print(random_table("one", rows))


def test_the_study_prints_published_beside_measured():
    console = Console(width=130, record=True)
    main(2, console)
    text = console.export_text()
    for words in ("(65.75)", "(0.67)", "finds a path", "2 of 2", "54.14"):
        assert words in text
