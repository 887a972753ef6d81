"""The cost to vehicles behind, and what of it is chance."""

from typing import Final

from experiments.metrics import columns, cut_in, followers, without_ego
from experiments.metrics.metric import Better, Metric

FOLLOWERS: Final = (
    Metric(
        column=columns.REAR_MAX_DECELERATION,
        label="max follower deceleration",
        compute=lambda e: followers.rear_max_deceleration(e.trace),
        formula="hardest braking of any follower while following, at least 0; null "
        "without followers",
        unit="m/s²",
        digits=2,
        better=Better.LOWER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.REAR_SPEED_LOSS,
        label="max follower speed loss",
        compute=lambda e: followers.rear_speed_loss(e.trace),
        formula="largest drop of a follower's speed while following: max (highest "
        "speed so far - current speed); null without followers",
        unit="m/s",
        digits=2,
        better=Better.LOWER,
    ),
)
WITHOUT_EGO: Final = (
    Metric(
        column=columns.BEHIND_COMPARED,
        label="vehicles compared with no-ego run",
        compute=lambda e: without_ego.n_compared(e.costs_behind),
        formula="vehicles behind the ego that are compared with the run without it; "
        "null, like the next four, without `simulation.without_ego`",
    ),
    Metric(
        column=columns.BEHIND_DELAY_MEAN,
        label="mean delay vs. no-ego run",
        compute=lambda e: without_ego.mean_delay(e.costs_behind),
        formula="mean delay at the last place that both runs reach; negative is a gain",
        unit="s",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.BEHIND_DELAY_MAX,
        label="max delay vs. no-ego run",
        compute=lambda e: without_ego.max_delay(e.costs_behind),
        formula="the same, largest",
        unit="s",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.BEHIND_SPEED_LOSS,
        label="max speed loss vs. no-ego run",
        compute=lambda e: without_ego.max_speed_loss(e.costs_behind),
        formula="largest (speed without the ego - speed with it) at the same place",
        unit="m/s",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.BEHIND_DECELERATION,
        label="added deceleration vs. no-ego run",
        compute=lambda e: without_ego.max_added_deceleration(e.costs_behind),
        formula="largest (hardest braking with the ego - without it) of one vehicle on "
        "the stretch shared by both runs, at least 0",
        unit="m/s²",
        digits=2,
        better=Better.LOWER,
    ),
)
CAUSAL: Final = (
    Metric(
        column=columns.CUT_IN_DECELERATION,
        label="cut-in: max follower deceleration",
        compute=lambda e: cut_in.max_deceleration(e.trace),
        formula="hardest braking of the follower in the lane that the ego changes to, "
        "from its body's first step over the line to 5 s after it is wholly in that "
        "lane, at least 0; null without a change or a follower",
        unit="m/s²",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.CUT_IN_ADDED,
        label="cut-in: added deceleration vs. no-ego run",
        compute=lambda e: cut_in.added_deceleration(e.trace, e.vehicles_without_ego),
        formula="the same less the hardest braking of that vehicle on that stretch "
        "without the ego, at least 0; null without `simulation.without_ego`",
        unit="m/s²",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.PLACEBO_DELAY_MEAN,
        label="placebo: mean delay",
        compute=lambda e: without_ego.mean_delay(e.costs_placebo),
        formula="mean delay of the same vehicles behind between two runs without the "
        "ego that differ in SUMO's random numbers from the ego's entry on: chance; "
        "null, like the next two, without `simulation.placebo`",
        unit="s",
        digits=2,
    ),
    Metric(
        column=columns.PLACEBO_SPEED_LOSS,
        label="placebo: max speed loss",
        compute=lambda e: without_ego.max_speed_loss(e.costs_placebo),
        formula="the same of the largest speed loss",
        unit="m/s",
        digits=2,
    ),
    Metric(
        column=columns.PLACEBO_DECELERATION,
        label="placebo: added deceleration",
        compute=lambda e: without_ego.max_added_deceleration(e.costs_placebo),
        formula="the same of the largest added deceleration",
        unit="m/s²",
        digits=2,
    ),
    Metric(
        column=columns.AHEAD_COMPARED,
        label="vehicles far ahead compared",
        compute=lambda e: without_ego.n_compared(e.costs_ahead),
        formula="vehicles always at least 50 m ahead of the ego, which it cannot "
        "influence, compared with the run without it; null, like the next three, "
        "without `simulation.without_ego`",
    ),
    Metric(
        column=columns.AHEAD_DELAY_MEAN,
        label="far ahead: mean delay",
        compute=lambda e: without_ego.mean_delay(e.costs_ahead),
        formula="mean delay of these vehicles: chance",
        unit="s",
        digits=2,
    ),
    Metric(
        column=columns.AHEAD_SPEED_LOSS,
        label="far ahead: max speed loss",
        compute=lambda e: without_ego.max_speed_loss(e.costs_ahead),
        formula="largest speed loss of these vehicles",
        unit="m/s",
        digits=2,
    ),
    Metric(
        column=columns.AHEAD_DECELERATION,
        label="far ahead: added deceleration",
        compute=lambda e: without_ego.max_added_deceleration(e.costs_ahead),
        formula="largest added deceleration of these vehicles",
        unit="m/s²",
        digits=2,
    ),
)
