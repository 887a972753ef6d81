"""Which stop lines of traffic lights are closed for the ego now.

A pure decision: no simulator, no memory. "Go" at yellow stays "go": driving on only
brings the ego closer. "Stop" stays "stop" by `kept`, the lines of the cycle before: a
planner that brakes late at first may be asked for more than comfortable braking.
"""

from collections.abc import Collection, Iterable

from experiments.cosim.records import Signal
from planner.vehicle import VehicleLimits

STOP = frozenset("ru")  # red, red-yellow
CLEARING = frozenset("y")
# G g o O s M m are open. Whether those that have to yield may go is decided in
# experiments.cosim.right_of_way.
COMFORTABLE_DECELERATION = 3.0  # that a yellow light may ask for [m/s²]
OVERSHOOT = 0.3  # a bumper stopped this far over the line still waits there [m]


def closed_stop_lines(
    signals: Iterable[Signal],
    front_s: float,
    speed: float,
    limits: VehicleLimits,
    kept: Collection[float] = (),
) -> tuple[float, ...]:
    """Return the stop lines that the ego has to respect now.

    Red holds unless not even emergency braking stops before the line; yellow holds
    if comfortable braking does, or service braking where it held before. Lines behind
    the front bumper are gone.

    Args:
        signals: The lights on the route.
        front_s: Arc length of the ego's front bumper [m].
        speed: Of the ego [m/s].
        limits: Contain the decelerations.
        kept: Lines that held in the cycle before [m].

    Returns:
        Arc lengths of the closed stop lines, growing [m].
    """
    closed = []
    for signal in signals:
        if signal.state in STOP:
            deceleration = limits.emergency_deceleration
        elif signal.state in CLEARING:
            deceleration = COMFORTABLE_DECELERATION
            if signal.stop_s in kept:
                deceleration = max(deceleration, limits.max_deceleration)
        else:
            continue
        if speed**2 / (2.0 * deceleration) <= signal.stop_s - front_s + OVERSHOOT:
            closed.append(signal.stop_s)
    return tuple(sorted(closed))
