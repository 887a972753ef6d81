from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from experiments.config.drivers import PopulationName
from sumo_nets.catalogue import network
from sumo_nets.demand import Demand, vehicles_for
from sumo_nets.driver_population import POPULATIONS, Spread, draw_type
from sumo_nets.errors import NetworkError
from sumo_nets.vehicle_types import KINDS

NAMES = st.sampled_from(sorted(POPULATIONS))


def test_scenarios_may_name_every_population():
    assert set(PopulationName.__args__) == set(POPULATIONS)


@given(
    st.floats(-5.0, 5.0),
    st.floats(0.01, 3.0),
    st.floats(0.1, 4.0),
    st.integers(0, 2**32 - 1),
)
def test_a_spread_stays_between_its_bounds(middle, deviation, width, seed):
    spread = Spread(middle, deviation, middle - width, middle + 2.0 * width)
    rng = np.random.default_rng(seed)
    drawn = [spread.draw(rng) for _ in range(20)]
    assert all(spread.low <= value <= spread.high for value in drawn)


def test_a_spread_is_a_truncated_normal_distribution():
    spread = Spread(1.3, 0.35, 0.7, 2.2)
    rng = np.random.default_rng(1)
    drawn = [spread.draw(rng) for _ in range(4000)]
    a, b = (spread.low - 1.3) / 0.35, (spread.high - 1.3) / 0.35
    law = stats.truncnorm(a, b, loc=1.3, scale=0.35)
    assert stats.kstest(drawn, law.cdf).pvalue > 0.01


@given(NAMES, st.sampled_from(sorted(KINDS)), st.integers(0, 2**32 - 1))
def test_every_driver_can_be_driven_by_sumo(population, kind, seed):
    model = POPULATIONS[population].models[0][0]
    drawn = draw_type(population, kind, model, "own.0", np.random.default_rng(seed))
    body = KINDS[kind]
    assert 0.0 < drawn.decel <= body.emergency_decel
    assert 0.0 < drawn.accel <= 4.0
    assert drawn.tau >= 0.4
    assert 0.7 <= drawn.factor <= body.highest_factor
    assert drawn.glances <= (POPULATIONS[population].glances is not None)


@given(NAMES, st.integers(0, 2**32 - 1))
def test_as_many_random_numbers_are_drawn_for_every_driver(population, seed):
    after = set()
    for kind in KINDS:
        rng = np.random.default_rng(seed)
        draw_type(population, kind, "IDM", "own.0", rng)
        after.add(rng.random())
    assert len(after) == 1


def test_no_two_drivers_are_alike_and_a_flow_has_the_shares_of_its_population():
    demand = Demand(own_veh_per_h=3000.0, population="distracted")
    vehicles = vehicles_for(network("straight"), demand, 4, 0.0, 3600.0)
    types = [vehicle.type for vehicle in vehicles]
    assert len({kind.tau for kind in types}) == len(types)
    looks_away = sum(kind.glances for kind in types)
    share = POPULATIONS["distracted"].glances.share
    assert stats.binomtest(looks_away, len(types), share).pvalue > 0.01
    idm = sum(kind.model == "IDM" for kind in types)
    assert stats.binomtest(idm, len(types), 0.6).pvalue > 0.01


def test_calm_drivers_keep_longer_gaps_than_aggressive_ones():
    taus = {}
    for name in ("calm", "urban", "aggressive"):
        demand = Demand(own_veh_per_h=1000.0, population=name)
        drawn = vehicles_for(network("straight"), demand, 1, 0.0, 3600.0)
        taus[name] = np.mean([vehicle.type.tau for vehicle in drawn])
    assert taus["calm"] > taus["urban"] > taus["aggressive"]


def test_an_unknown_population_is_refused():
    with pytest.raises(NetworkError, match='population "polite" is unknown; allowed:'):
        Demand(population="polite")


def test_a_vehicle_type_says_whatever_was_drawn():
    drawn = draw_type("distracted", "car", "Krauss", "own.0", np.random.default_rng(3))
    written = drawn.attributes()
    for key, name in (("tau", "tau"), ("min_gap", "minGap"), ("accel", "accel")):
        assert float(written[name]) == pytest.approx(getattr(drawn, key), abs=1e-3)
    assert {field.name for field in fields(drawn)} >= {"glances", "impatience"}
