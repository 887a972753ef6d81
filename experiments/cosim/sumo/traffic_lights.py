"""The traffic lights of a road, as SUMO shows them now."""

from collections.abc import Sequence

from experiments.cosim.records import Signal
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.errors import SimulationError
from sumo_nets.route_path import StopLine


def check_stop_lines(sumo: Libsumo, lines: Sequence[StopLine]) -> None:
    """Check that each traffic light has the letter of its stop line.

    Raises:
        SimulationError: If one has not.
    """
    for line in lines:
        state = sumo.trafficlight.getRedYellowGreenState(line.signal)
        if not 0 <= line.link < len(state):
            raise SimulationError(
                f"traffic light {line.signal!r} has links 0 to {len(state) - 1}, "
                f"no {line.link}"
            )


def read_signals(
    sumo: Libsumo, lines: Sequence[StopLine], known: dict[str, str]
) -> tuple[Signal, ...]:
    """Read the letter of each stop line.

    Args:
        sumo: The running libsumo module.
        lines: Of the road.
        known: What was read in this step already, by traffic light; is added to.
    """
    for line in lines:
        if line.signal not in known:
            state = sumo.trafficlight.getRedYellowGreenState(line.signal)
            known[line.signal] = state
    return tuple(
        Signal(line.signal, line.s, known[line.signal][line.link]) for line in lines
    )
