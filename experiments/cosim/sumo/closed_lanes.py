"""Lanes that are closed, and what SUMO's own driver in the ego's place knows of them.

SUMO's drivers plan their lanes by the classes of vehicles that may use them. So the ego
of SUMO's driver has a class of its own: one that may use the closed lanes as long as
the driver does not know of the closure, and another one from then on. No other vehicle
has either class.
"""

from collections.abc import Sequence

from experiments.cosim.sumo.lanes import TRAFFIC_CLASS
from experiments.cosim.sumo.libsumo_api import Libsumo

TOLD = "custom1"  # class of an ego that knows of the closure
NOT_TOLD = "custom2"


def close_to_traffic(sumo: Libsumo, lanes: Sequence[str]) -> None:
    """Admit nobody to lanes but an ego that does not know better."""
    for name in lanes:
        sumo.lane.setAllowed(name, [NOT_TOLD])


def close_to_told_ego(sumo: Libsumo, lanes: Sequence[str]) -> None:
    """Admit the ego's two classes wherever cars may go, but `TOLD` not to `lanes`."""
    for name in sumo.lane.getIDList():
        allowed = sumo.lane.getAllowed(name)  # empty: everybody
        if TRAFFIC_CLASS in allowed:
            sumo.lane.setAllowed(name, sorted({*allowed, TOLD, NOT_TOLD}))
    for name in lanes:
        allowed = sumo.lane.getAllowed(name)
        if allowed:
            sumo.lane.setAllowed(name, sorted(set(allowed) - {TOLD}))
        else:
            sumo.lane.setDisallowed(name, [TOLD])
