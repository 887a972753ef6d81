"""What a passenger feels, and what the vehicle is asked for."""

from typing import Final

from experiments.metrics import columns, comfort, limits
from experiments.metrics.metric import Better, CellKind, Metric

COMFORT: Final = (
    Metric(
        column=columns.MEAN_J_JERK,
        label="mean jerk cost",
        compute=lambda e: comfort.mean_cost(e.trace, comfort.JERK_COST),
        formula="mean over planning cycles of ∫ jerk² dt of the selected trajectory; "
        "null unless the planner reports `jerk_integral`",
        unit="m²/s⁵",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.MEAN_J_OFFSET,
        label="mean offset cost",
        compute=lambda e: comfort.mean_cost(e.trace, comfort.OFFSET_COST),
        formula="mean over planning cycles of the mean l² of the selected trajectory; "
        "null unless the planner reports `mean_offset_squared`",
        unit="m²",
        digits=3,
        better=Better.LOWER,
    ),
    Metric(
        column=columns.RMS_JERK,
        label="RMS jerk",
        compute=lambda e: comfort.rms_jerk(e.trace),
        formula="√ mean ‖a_(k+1) - a_k‖² / Δt² with a = (tangential acceleration, "
        "κv²), as experienced by a passenger",
        unit="m/s³",
        digits=2,
        better=Better.LOWER,
        in_terminal=True,
        compared=True,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_ACCELERATION,
        label="max abs. acceleration",
        compute=lambda e: comfort.max_abs_acceleration(e.trace),
        formula="max |tangential acceleration|",
        unit="m/s²",
        digits=2,
        better=Better.LOWER,
        in_terminal=True,
        compared=True,
    ),
    Metric(
        column=columns.MAX_LATERAL_ACCELERATION,
        label="max lateral acceleration",
        compute=lambda e: comfort.max_abs_lateral_acceleration(e.trace),
        formula="max |κv²|",
        unit="m/s²",
        digits=2,
        better=Better.LOWER,
        in_terminal=True,
        of_planner=True,
    ),
    Metric(
        column=columns.LATERAL_DISCOMFORT,
        label="uncomfortable sideways",
        compute=lambda e: comfort.lateral_discomfort(e.trace),
        formula="share of steps with |κv²| > 2.2 m/s²",
        digits=3,
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.BRAKING_DISCOMFORT,
        label="uncomfortable braking",
        compute=lambda e: comfort.braking_discomfort(e.trace),
        formula="share of steps with a deceleration > 3.5 m/s²",
        digits=3,
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_LATERAL_JERK,
        label="max lateral jerk",
        compute=lambda e: comfort.max_lateral_jerk(e.trace),
        formula="max |change of κv² in 0.5 s| / 0.5 s; null for a shorter episode",
        unit="m/s³",
        digits=2,
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_TANGENTIAL_JERK,
        label="max jerk along the path",
        compute=lambda e: comfort.max_tangential_jerk(e.trace),
        formula="max |change of the tangential acceleration in 0.5 s| / 0.5 s; null for"
        " a shorter episode",
        unit="m/s³",
        digits=2,
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.LATERAL_REVERSALS,
        label="lateral reversals",
        compute=lambda e: comfort.lateral_reversals(e.trace),
        formula="changes of sign of κv² where |κv²| > 0.3 m/s², in a minute",
        unit="1/min",
        digits=1,
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_CURVATURE,
        label="max curvature",
        compute=lambda e: comfort.max_abs_curvature(e.trace),
        formula="max |κ| of the driven path",
        unit="1/m",
        digits=4,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_FRONT_WHEEL,
        label="max front-wheel angle",
        compute=lambda e: comfort.max_front_wheel_angle(e.trace),
        formula="max |δ|, tan δ = L κ with the wheelbase L: kinematic single-track "
        "model, [Thesis] eq. 3.8",
        unit="rad",
        digits=3,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_FRONT_WHEEL_RATE,
        label="max front-wheel rate",
        compute=lambda e: comfort.max_front_wheel_rate(e.trace),
        formula="max |δ_(k+1) - δ_k| / Δt; null for a single step",
        unit="rad/s",
        digits=3,
        better=Better.LOWER,
        of_planner=True,
    ),
    Metric(
        column=columns.MAX_HEADING,
        label="max heading error",
        compute=lambda e: comfort.max_heading(e.trace),
        formula="max |ego heading - path heading|; null if the ego was never projected "
        "on the path",
        unit="rad",
        digits=3,
        of_planner=True,
    ),
    Metric(
        column=columns.OVER_LIMITS_STEPS,
        label="steps over vehicle limits",
        kind=CellKind.WHOLE,
        compute=lambda e: limits.steps_over_limits(e.trace, e.limits),
        formula="steps in which speed, acceleration, braking (against emergency "
        "braking), lateral acceleration or curvature is more than 1 % over the limit "
        "in `ego.vehicle.limits`; null without a step",
        better=Better.LOWER,
    ),
)
