"""Bodies as the kernels take them, and the arrays that these work with."""

from typing import NamedTuple

import numpy as np

from planner.cruise.candidate_motion import Lateral, RoadTables, Tracks
from planner.cruise.feasibility import CandidateLimits
from planner.numerics.compiled import inlined
from planner.states import BoolArray, FloatArray, IntArray

# Rows of the frames: the axle in the body's frame, (U, W) + change · (UNIT_U, UNIT_W);
# the road's direction in it; how far a point of the ego can move in it since the step
# before; the gap that candidates have at least whose gap is not taken.
U, UNIT_U, W, UNIT_W, ROAD_U, ROAD_W, MOVED, FAR = range(8)
N_FRAME = 8
LANES = 4  # candidates that the compiler takes at once; arrays of them are padded
# Rows of the sway: bounds over all offsets of |sin e| and of what e changes in a step.
ASKEW, TURNED = 0, 1
N_SWAY = 2


class FollowingRules(NamedTuple):
    """The ego's body, and the room that it keeps to other bodies."""

    discs: tuple[float, float, float]  # centres ahead of the rear axle, rear first [m]
    disc_radius: float
    range: float  # gap from which on a body costs nothing [m]
    corridor: float  # room that the ego needs on each side of its path [m]
    front_reach: float  # rear axle to front bumper [m]
    rear_overhang: float  # rear axle to rear bumper [m]
    deceleration: float  # with which the ego can stop [m/s²]
    standstill_gap: float  # kept ahead at any speed [m]
    time_headway: float  # kept ahead beyond it [s]
    rear_time_headway: float  # left behind [s]


class Surroundings(NamedTuple):
    """Bodies, the gaps to each, and the rules of following, in one flat record.

    The fields of `planner.bodies.BodyTable`, three of its own, and those of
    `FollowingRules`, in their order.
    """

    poses: FloatArray  # (n_bodies, 4, n_steps)
    s: FloatArray  # (n_bodies, n_steps)
    l: FloatArray  # (n_bodies, n_steps)
    speed: FloatArray  # (n_bodies,)
    extents: FloatArray  # (n_bodies, 3)
    size: FloatArray  # (n_bodies,)
    stride: FloatArray  # longest way in one step, (n_bodies,) [m]
    spin: FloatArray  # largest turn in one step, (n_bodies,) [rad]
    follower: BoolArray  # (n_bodies,)
    n_static: int
    threshold: FloatArray  # gap below which a candidate collides, (n_bodies,) [m]
    turn_gap: FloatArray  # room to steer round what stands, else 0, (n_bodies,) [m]
    more_discs: FloatArray  # of a long ego, between the last two of its discs, (n,) [m]
    discs: tuple[float, float, float]
    disc_radius: float
    range: float
    corridor: float
    front_reach: float
    rear_overhang: float
    deceleration: float
    standstill_gap: float
    time_headway: float
    rear_time_headway: float


class CycleTables(NamedTuple):
    """What the candidates of one cycle are evaluated with."""

    tracks: Tracks
    lateral: Lateral
    limits: CandidateLimits
    road: RoadTables
    around: Surroundings
    speed_term: FloatArray  # price of each profile's speed, (n_profiles,) [-]
    lane_term: FloatArray  # price of each terminal offset, (n_offsets,) [-]


class Bench(NamedTuple):
    """Arrays that are filled for each profile, and for each body beside it.

    Arrays over offsets hold the candidates looked at, padded to a multiple of `LANES`.
    """

    basis: FloatArray  # lateral basis, (8, n_steps), rows named in `motion`
    change: FloatArray  # of offset, growing, (n_offsets,) [m]
    course: FloatArray  # cos and sin of the heading error, (2, n_steps, n_offsets)
    sideways: FloatArray  # lateral acceleration at the last step, (n_offsets,) [m/s²]
    sway: FloatArray  # (2, n_steps)
    frames: FloatArray  # (8, n_steps)
    gaps: FloatArray  # (n_steps, n_offsets) [m]
    window: IntArray  # offsets whose gaps are taken: first and last + 1, (2, n_steps)
    nearest: FloatArray  # least gap so far, (n_offsets,) [m]
    limit: FloatArray  # only gaps below it matter, (n_offsets,) [m]
    until: FloatArray  # step from which on gaps do not matter, (n_offsets,)
    flag: IntArray  # 1 where a way is to be looked at, else 0, (n_steps, n_offsets)
    flagged: IntArray  # how many these are, (n_steps,)
    number: IntArray  # 0, 1, 2 ..., (n_offsets,)
    hit_step: IntArray  # -1 without a hit, (n_offsets,)


@inlined
def padded_size(n: int) -> int:
    """Return the next multiple of `LANES`."""
    return n + -n % LANES


@inlined
def fill_padded(delta_l: FloatArray, chosen: IntArray, change: FloatArray) -> None:
    """Fill `change` with the chosen changes of offset, the last one repeated."""
    for o in range(change.size):
        change[o] = delta_l[chosen[min(o, chosen.size - 1)]]


@inlined
def make_bench(basis: FloatArray, n_padded: int) -> Bench:
    """Allocate the arrays; those that are not always filled start finite."""
    n_steps = basis.shape[1]
    return Bench(
        basis,
        np.empty(n_padded),
        np.zeros((2, n_steps, n_padded)),
        np.zeros(n_padded),
        np.empty((N_SWAY, n_steps)),
        np.empty((N_FRAME, n_steps)),
        np.empty((n_steps, n_padded)),
        np.empty((2, n_steps), np.int64),
        np.empty(n_padded),
        np.empty(n_padded),
        np.empty(n_padded),
        np.zeros((n_steps, n_padded), np.int64),
        np.empty(n_steps, np.int64),
        np.arange(n_padded),
        np.empty(n_padded, np.int64),
    )
