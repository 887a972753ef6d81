"""How hard a driver is expected to brake behind a car that cuts in.

Neither the model nor the wished time gap of that driver is known: the expectation is
over two models and three time gaps. It is a cost, so that calm gaps are preferred;
whether a gap is safe is decided without it.

Sources: Krauss, Metastable states in a microscopic model of traffic flow, Phys. Rev. E
55 (1997) 5597, eq. for the safe speed. Treiber, Hennecke, Helbing, Phys. Rev. E 62
(2000) 1805, eq. 2, 3 (IDM).
"""

import math

from planner.numerics.compiled import inlined

TIME_GAPS = (0.8, 1.2, 1.8)  # wished by hasty, normal and careful drivers [s]
TIME_GAP_SHARES = (0.2, 0.55, 0.25)
STANDSTILL_GAP = 2.5  # [m]
COMFORTABLE = 4.0  # braking that a driver after Krauss counts on [m/s²]
CORRECTED_IN = 0.5  # a speed above the safe one is taken back in about this [s]
IDM_ACCELERATION = 2.0  # [m/s²]
IDM_SHARE = 0.5  # of the drivers; the others drive after Krauss
HARDEST = 6.0  # braking counts as no more than this [m/s²]


@inlined
def expected_braking(gap: float, speed: float, leader_speed: float) -> float:
    """Return the expected braking of a driver, >= 0 [m/s²].

    Args:
        gap: To the vehicle ahead, from bumper to bumper [m].
        speed: Of the driver [m/s].
        leader_speed: [m/s].
    """
    room = max(gap - STANDSTILL_GAP, 0.0)
    approach = speed * (speed - leader_speed)
    approach /= 2.0 * math.sqrt(IDM_ACCELERATION * COMFORTABLE)
    expected = 0.0
    for k in range(3):
        tau, share = TIME_GAPS[k], TIME_GAP_SHARES[k]
        back = COMFORTABLE * tau
        square = back * back + leader_speed * leader_speed + 2.0 * COMFORTABLE * room
        krauss = max(speed - (math.sqrt(square) - back), 0.0) / CORRECTED_IN
        desired = STANDSTILL_GAP + max(speed * tau + approach, 0.0)
        idm = IDM_ACCELERATION * (desired / max(gap, 0.1)) ** 2
        krauss, idm = min(krauss, HARDEST), min(idm, HARDEST)
        expected += share * (IDM_SHARE * idm + (1.0 - IDM_SHARE) * krauss)
    return expected
