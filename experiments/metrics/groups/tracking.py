"""How well the ego follows its plans and sees the others."""

from typing import Final

from experiments.metrics import columns, tracking
from experiments.metrics.metric import Better, Metric

TRACKING: Final = (
    Metric(
        column=columns.TRACKING_LATERAL_MAX,
        label="max lateral tracking error",
        compute=lambda e: tracking.max_error(e.trace, "lateral_error_m"),
        formula="largest distance of the rear axle from the plan that it follows; "
        "null, like the next seven, with a perfect plant",
        unit="m",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.TRACKING_LATERAL_RMS,
        label="RMS lateral tracking error",
        compute=lambda e: tracking.rms_error(e.trace, "lateral_error_m"),
        formula="the same, root mean square",
        unit="m",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.TRACKING_LONGITUDINAL_MAX,
        label="max longitudinal tracking error",
        compute=lambda e: tracking.max_error(e.trace, "behind_m"),
        formula="largest distance along the plan from the plan's point of the same "
        "time",
        unit="m",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.TRACKING_LONGITUDINAL_RMS,
        label="RMS longitudinal tracking error",
        compute=lambda e: tracking.rms_error(e.trace, "behind_m"),
        formula="the same, root mean square",
        unit="m",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.LIMITED_SHARE,
        label="time at a limit",
        compute=lambda e: tracking.limited_share(e.trace),
        formula="share of time in which steering, drive or grip is at its limit",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.COMMAND_JERK,
        label="RMS commanded jerk",
        compute=lambda e: tracking.rms_command_jerk(e.trace),
        formula="√ mean (Δ drive command / Δt)²; the driven one is `rms_jerk_mps3`",
        unit="m/s³",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.GRIP_MAX,
        label="max share of grip",
        compute=lambda e: tracking.max_error(e.trace, "grip"),
        formula="largest acceleration in the plane over friction times gravity",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.PLANS_ANEW,
        label="plans begun anew",
        compute=lambda e: tracking.plans_anew(e.trace),
        formula="plans that did not begin on the last one, because the ego was too "
        "far from it",
        better=Better.LOWER,
    ),
    Metric(
        column=columns.NEAREST_ERROR,
        label="position error of the nearest vehicle",
        compute=lambda e: tracking.nearest_error(e.trace),
        formula="mean distance from where the nearest vehicle is to where the ego "
        "believes it; null, like the next one, with perfect perception",
        unit="m",
        digits=2,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.UNSEEN_NEAR,
        label="vehicles nearby not believed in",
        compute=lambda e: tracking.unseen_near(e.trace),
        formula="share of vehicles within 30 m of the rear axle that the ego does "
        "not believe in",
        digits=3,
        better=Better.LOWER,
    ),
)
