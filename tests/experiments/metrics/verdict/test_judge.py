"""Verdicts on made-up contacts with a known answer."""

import numpy as np
import pytest

from experiments.metrics.verdict.judge import judge_contact
from experiments.metrics.verdict.records import Fault
from tests.experiments.metrics.verdict.made_up import STEP, contact, track

EGO, OTHER, SHARED = Fault.EGO, Fault.OTHER, Fault.SHARED
NEITHER, ARTEFACT = Fault.UNAVOIDABLE, Fault.ARTEFACT
LANE = 3.5
ACROSS = 0.5 * np.pi
WALL = {"road": (1.0, -1.0)}  # no room to swerve

CASES = {
    # rear-end
    "follower drives into a braking ego": (
        OTHER,
        lambda: contact(track(30, 0, 20, braking=4, from_t=2), track(0, 0, 20)),
    ),
    "follower drives into a standing ego": (
        OTHER,
        lambda: contact(track(100, 0, 0), track(0, 0, 15)),
    ),
    "follower drives into a slower ego": (
        OTHER,
        lambda: contact(track(60, 0, 8), track(0, 0, 16)),
    ),
    "lorry drives into a braking ego": (
        OTHER,
        lambda: contact(
            track(35, 0, 18, braking=6, from_t=1),
            track(0, 0, 18, length=14, width=2.5),
        ),
    ),
    "ego drives into a braking leader": (
        EGO,
        lambda: contact(track(0, 0, 20), track(30, 0, 20, braking=4, from_t=2)),
    ),
    "ego drives into a standing vehicle": (
        EGO,
        lambda: contact(track(0, 0, 15), track(100, 0, 0)),
    ),
    "ego drives into a slower vehicle": (
        EGO,
        lambda: contact(track(0, 0, 16), track(60, 0, 8)),
    ),
    "ego drives into the end of a queue, a wall on both sides": (
        EGO,
        lambda: contact(track(0, 0, 14), track(90, 0, 0), **WALL),
    ),
    "ego brakes too late for the leader": (
        EGO,
        lambda: contact(
            track(0, 0, 20, braking=8, from_t=3.6), track(90, 0, 0), **WALL
        ),
    ),
    # standing obstacles
    "ego drives into an obstacle ahead": (
        EGO,
        lambda: contact(
            track(0, 0, 12), track(80, 0, 0, length=2, width=2), standing=True
        ),
    ),
    "ego grazes an obstacle at the edge": (
        EGO,
        lambda: contact(
            track(0, 0, 12), track(80, 1.6, 0, length=1, width=1.5), standing=True
        ),
    ),
    "ego swerves into an obstacle": (
        EGO,
        lambda: contact(
            track(0, 0, 12, side=3, side_at=4),
            track(75, 3, 0, length=2, width=2),
            standing=True,
        ),
    ),
    "obstacle five metres ahead at the start, no room": (
        NEITHER,
        lambda: contact(
            track(0, 0, 20), track(9, 0, 0, length=2, width=2), standing=True, **WALL
        ),
    ),
    # cut-ins
    "cut-in at 0.3 s headway by a slower car": (
        OTHER,
        lambda: contact(
            track(0, 0, 20), track(20, -LANE, 12, side=LANE, side_at=0.2, side_s=2)
        ),
    ),
    "cut-in that scrapes the ego's front": (
        OTHER,
        lambda: contact(
            track(0, 0, 20), track(6, -LANE, 19, side=LANE, side_at=1, side_s=2)
        ),
    ),
    "cut-in from the left, hard": (
        OTHER,
        lambda: contact(
            track(0, 0, 25), track(16, LANE, 15, side=-LANE, side_at=0.2, side_s=1.5)
        ),
    ),
    "car cuts in far ahead, ego never brakes": (
        EGO,
        lambda: contact(
            track(0, 0, 20), track(120, -LANE, 8, side=LANE, side_at=0.5, side_s=2)
        ),
    ),
    "lorry cuts in far ahead, ego never brakes": (
        EGO,
        lambda: contact(
            track(0, 0, 22),
            track(140, LANE, 10, side=-LANE, side_at=0.5, length=14, width=2.5),
        ),
    ),
    "ego cuts in close ahead of a faster car": (
        EGO,
        lambda: contact(
            track(10, -LANE, 12, side=LANE, side_at=0.5, side_s=2), track(0, 0, 22)
        ),
    ),
    "ego cuts in far ahead, the follower never brakes": (
        OTHER,
        lambda: contact(
            track(130, -LANE, 8, side=LANE, side_at=0.5, side_s=2), track(0, 0, 20)
        ),
    ),
    # abreast
    "other changes into the ego beside it": (
        OTHER,
        lambda: contact(
            track(0, 0, 15), track(1, LANE, 15, side=-LANE, side_at=3, side_s=3)
        ),
    ),
    "ego changes into a car beside it": (
        EGO,
        lambda: contact(
            track(0, 0, 15, side=LANE, side_at=3, side_s=3), track(1, LANE, 15)
        ),
    ),
    "ego changes into a lorry beside it": (
        EGO,
        lambda: contact(
            track(0, 0, 15, side=-LANE, side_at=3, side_s=3),
            track(-2, -LANE, 15, length=14, width=2.5),
        ),
    ),
    "both change into the middle lane": (
        SHARED,
        lambda: contact(
            track(0, -LANE, 15, side=LANE, side_at=3, side_s=3),
            track(1, LANE, 15, side=-LANE, side_at=3, side_s=3),
        ),
    ),
    # head-on
    "other comes over the line": (
        OTHER,
        lambda: contact(
            track(0, 0, 15),
            track(100, LANE, 15, heading=np.pi, side=LANE, side_at=1.5, side_s=1.5),
        ),
    ),
    "ego overtakes into oncoming traffic": (
        EGO,
        lambda: contact(
            track(0, 0, 15, side=LANE, side_at=1, side_s=2),
            track(110, LANE, 15, heading=np.pi),
        ),
    ),
    "other drives the wrong way in the ego's lane": (
        OTHER,
        lambda: contact(track(0, 0, 15), track(150, 0, 15, heading=np.pi), **WALL),
    ),
    "both come over the line": (
        SHARED,
        lambda: contact(
            track(0, 0, 15, side=0.5 * LANE, side_at=1, side_s=2),
            track(100, LANE, 15, heading=np.pi, side=0.5 * LANE, side_at=1, side_s=2),
        ),
    ),
    # crossings
    "other does not give way, shortly before": (
        OTHER,
        lambda: contact(
            track(0, 0, 14), track(30, -29, 14, heading=ACROSS), yields="other"
        ),
    ),
    "ego does not give way": (
        EGO,
        lambda: contact(
            track(0, 0, 14), track(60, -58, 14, heading=ACROSS), yields="ego"
        ),
    ),
    "ego pulls out from a stop": (
        EGO,
        lambda: contact(
            track(0, 0, 3), track(6, -28, 14, heading=ACROSS), yields="ego"
        ),
    ),
    "other turns left across the ego": (
        OTHER,
        lambda: contact(
            track(0, 0, 14),
            track(24, 9, 7, heading=-ACROSS - 0.3),
            yields="other",
        ),
    ),
    "other stands across the ego's way for long": (
        EGO,
        lambda: contact(
            track(0, 0, 14), track(110, 0, 0, heading=ACROSS), yields="other"
        ),
    ),
    "a car comes from the side without rules": (
        SHARED,
        lambda: contact(track(0, 0, 14), track(28, -24, 12, heading=ACROSS)),
    ),
    # unavoidable
    "both inserted a metre apart at speed": (
        NEITHER,
        lambda: contact(track(0, 0, 25), track(6.5, 0, 0), **WALL),
    ),
    "head-on from the start, twelve metres apart": (
        NEITHER,
        lambda: contact(track(0, 0, 15), track(14, 0, 15, heading=np.pi), **WALL),
    ),
    # artefacts
    "other appears in front of the ego": (
        ARTEFACT,
        lambda: contact(track(0, 0, 20), track(60, 0, 5, appears=3.0)),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_made_up_contact_has_its_verdict(name):
    fault, make = CASES[name]
    case = make()
    verdict = judge_contact(case)
    assert verdict.fault is fault, verdict
    assert 0 <= verdict.step < len(case.ego.x)


def standing_lorry(turn=0.0, side=0.0, ahead=0.0):
    """Return a lorry beside a standing ego that moves as none can in the last step."""
    lorry = track(8.0, 3.0, 0.0, length=14.0, width=2.5)
    n = 60
    heading, x, y = lorry.heading.copy(), lorry.x.copy(), lorry.y.copy()
    heading[n:] += turn * np.arange(1, len(x) - n + 1)
    y[n:] -= side * np.arange(1, len(x) - n + 1)
    x[n:] -= ahead * np.arange(1, len(x) - n + 1)
    return type(lorry)(
        x, y, heading, lorry.speed, lorry.acceleration, lorry.length, lorry.width
    )


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ({"turn": 0.05}, "turns on the spot"),
        ({"side": 0.1}, "slides sideways"),
        ({"side": 1.0}, "jumps sideways"),
    ],
)
def test_motion_that_no_vehicle_makes_is_an_artefact(motion, words):
    verdict = judge_contact(contact(track(0.0, 0.0, 0.0), standing_lorry(**motion)))
    assert verdict.fault is ARTEFACT
    assert words in verdict.why


def test_the_moment_lies_where_braking_alone_just_stops():
    speed, gap = 20.0, 100.0
    case = contact(track(0, 0, speed), track(gap + 4.8, 0, 0), **WALL)
    verdict = judge_contact(case)
    needed = speed**2 / (2.0 * 8.0)
    assert verdict.last_ego * STEP == pytest.approx((gap - needed) / speed, abs=0.11)
