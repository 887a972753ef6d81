"""Which point of a body is led, and its wheels before it moves off."""

import math

import numpy as np

from planner.cruise.settings import CruiseSettings, LateralMotion
from planner.scene import Scene
from planner.vehicle import Vehicle, body_scale

LONG = 1.5  # times as long as a car, a body is led by its front [-]
# A vehicle that stands can turn its wheels before it starts: its motions need not
# begin with the curvature that it stopped with, which may leave none within the limits.
WHEELS_TURN_FREELY = 0.02  # [m/s]
START_SHARE = 0.8  # of the largest curvature, to which wheels are turned there [-]
WHEEL_SHARES = (0.5, 0.75)  # of that, which are tried to either side [-]


def led_point(vehicle: Vehicle, settings: CruiseSettings) -> float:
    """Return how far ahead of its axle a body is led [m]; 0 at the axle itself.

    The front of a long body goes farther to the side than its axle while it turns, over
    the road's edge beside what it goes round. It is led by its front axle, as its
    driver leads it, and the rear axle comes after.
    """
    over_distance = settings.lateral_motion is LateralMotion.DISTANCE
    leads = settings.lead_long_bodies and over_distance and settings.cover_discs > 1
    return vehicle.wheelbase if leads and body_scale(vehicle) > LONG else 0.0


def turning_scale(vehicle: Vehicle, settings: CruiseSettings) -> float:
    """Return how much more room than a car a body needs to steer round what stands."""
    scale = body_scale(vehicle)
    return math.sqrt(scale) if led_point(vehicle, settings) > 0.0 else scale


def wheels_before_start(
    slope: float, lead: float, vehicle: Vehicle, road: float
) -> float:
    """Return l'' of an ego that stands: its wheels are turned before it moves off.

    Along the road, or so that the led point goes along it from there on, as far as the
    wheels turn beside the curvature of the `road` [1/m].
    """
    if lead == 0.0:
        return 0.0
    low, high = _wheels_within(vehicle, road)
    return min(max(-slope / lead, low), high)


def _wheels_within(vehicle: Vehicle, road: float) -> tuple[float, float]:
    """How far wheels turn to the right and left, beside the road's curvature [1/m]."""
    most = START_SHARE * vehicle.limits.max_curvature
    return min(-most - road, 0.0), max(most - road, 0.0)


def wheels_turned(scene: Scene) -> tuple[float, ...]:
    """Return curvatures beside the road's to turn the wheels to before moving off.

    An ego that stands askew where the road swings may have to steer out before it turns
    in, as a driver does who turns the wheel while standing.

    Returns:
        The smaller ones first [1/m]; none unless the ego stands.
    """
    if scene.ego.speed >= WHEELS_TURN_FREELY:
        return ()
    road = float(scene.path.at(np.array([scene.ego_frenet.s])).curvature[0])
    right, left = _wheels_within(scene.vehicle, road)
    return tuple(share * side for share in WHEEL_SHARES for side in (left, right))
