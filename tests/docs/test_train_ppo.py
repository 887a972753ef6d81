"""The script of the tutorial: its gradients, and that it trains at all."""

import importlib.util

import numpy as np
import pytest

from tests.docs.documents import ROOT

pytest.importorskip("gymnasium")


@pytest.fixture(scope="module")
def ppo():
    place = ROOT / "docs" / "tutorials" / "train_ppo.py"
    spec = importlib.util.spec_from_file_location("train_ppo", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_gradients_are_those_of_differences(ppo):
    rng = np.random.default_rng(1)
    network = ppo.Network.random(rng, 5)
    network.weights = [w + 0.1 * rng.standard_normal(w.shape) for w in network.weights]
    x, chosen, weight = (
        rng.standard_normal((7, 5)),
        rng.integers(0, 3, 7),
        rng.random(7),
    )

    def loss():
        _, _, (lanes, _, value) = network.forward(x)
        p = ppo.probabilities(lanes)
        gain = (weight * np.log(p[np.arange(7), chosen])).sum()
        entropy = -(p * np.log(p)).sum()
        return -gain - 0.3 * entropy + 0.5 * (value**2).sum()

    first, second, (lanes, speeds, value) = network.forward(x)
    d_out = np.hstack(
        [
            ppo.d_logits(lanes, chosen, weight, 0.3),
            np.zeros_like(speeds),
            value[:, None],
        ]
    )
    found = network.gradients(x, first, second, d_out)
    for w, gradient in zip(network.weights, found, strict=True):
        place = tuple(rng.integers(0, n) for n in w.shape)
        kept = w[place]
        w[place] = kept + 1e-5
        high = loss()
        w[place] = kept - 1e-5
        low = loss()
        w[place] = kept
        assert gradient[place] == pytest.approx((high - low) / 2e-5, abs=1e-6)


def test_advantages_are_discounted_sums_where_nothing_is_expected(ppo):
    rewards = np.array([1.0, 2.0, 3.0, 4.0])
    ended = np.array([False, True, False, False])
    factor = ppo.DISCOUNT * ppo.LAMBDA
    found = ppo.advantages(np.zeros(4), rewards, ended, 10.0)
    last = 4.0 + ppo.DISCOUNT * 10.0
    assert found == pytest.approx([1 + factor * 2, 2.0, 3 + factor * last, last])


@pytest.mark.sumo
@pytest.mark.slow
def test_a_few_updates_make_a_policy_that_drives(ppo, tmp_path, monkeypatch):
    monkeypatch.setattr(ppo, "BATCH", 128)
    monkeypatch.setattr(ppo, "VALIDATION", range(800, 802))
    rows = []
    network = ppo.train(2, 0, lambda *row: rows.append(row))
    assert [row[0] for row in rows] == [128, 256]
    assert 0.0 <= rows[-1][2] <= 1.0
    np.savez(tmp_path / "p.npz", **{f"w{k}": w for k, w in enumerate(network.weights)})
    planner = ppo.make(str(tmp_path / "p.npz"))
    assert planner.repeat == ppo.REPEAT
    ppo.draw(rows, tmp_path / "curve.svg")
    assert (tmp_path / "curve.svg").stat().st_size > 1000
