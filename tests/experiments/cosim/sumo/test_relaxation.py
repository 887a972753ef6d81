import pytest

from experiments.cosim.sumo.relaxation import SHORTEST_GAP, Relaxation


class Vehicles:
    """Stands for SUMO: one follower at a time, whose time gap is set."""

    def __init__(self, gap, speed=20.0, tau=1.5):
        self.gap, self.speed, self.tau = gap, speed, tau
        self.follower = "f"

    def getFollower(self, name, reach):
        return self.follower, self.gap

    def getSpeed(self, name):
        return self.speed

    def getTau(self, name):
        return self.tau

    def setTau(self, name, tau):
        self.tau = tau

    def getIDList(self):
        return ("ego", "f")


class Sumo:
    def __init__(self, vehicle):
        self.vehicle = vehicle


def test_the_time_gap_is_that_of_the_cut_in_and_returns_linearly():
    vehicles = Vehicles(gap=10.0)
    relaxation = Relaxation(Sumo(vehicles), 10.0)
    relaxation.update(0.0, ("ego",))
    assert vehicles.tau == pytest.approx(0.5)
    relaxation.update(5.0, ("ego",))
    assert vehicles.tau == pytest.approx(1.0)
    relaxation.update(10.0, ("ego",))
    assert vehicles.tau == 1.5
    vehicles.gap = 1.0  # the same follower, however near: nobody cut in
    relaxation.update(11.0, ("ego",))
    assert vehicles.tau == 1.5


def test_nobody_accepts_less_than_the_shortest_gap_or_relaxes_without_need():
    near = Vehicles(gap=-3.0)
    Relaxation(Sumo(near), 10.0).update(0.0, ("ego",))
    assert near.tau == SHORTEST_GAP
    far = Vehicles(gap=60.0)
    Relaxation(Sumo(far), 10.0).update(0.0, ("ego",))
    assert far.tau == 1.5
