"""A conflict of UN Regulation 157: another vehicle and what it does to the ego."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from experiments.config.base import Rate, Size, Speed, Strict, mismatch

STEP_S: Final = 0.1  # of the conflicts' motion [s]
N_LANES: Final = 3
NEEDED: Final = {
    "cut_in": ("other_speed_mps", "gap_m", "lateral_speed_mps"),
    "cut_out": ("gap_m", "lateral_speed_mps"),
    "braking": ("deceleration_mps2",),
}
ALLOWED: Final = {
    "cut_in": NEEDED["cut_in"],
    "cut_out": (*NEEDED["cut_out"], "following_gap_m"),
    "braking": (*NEEDED["braking"], "following_gap_m"),
}
Gap = Annotated[float, Field(gt=0.0, le=1000.0)]
LateralSpeed = Annotated[float, Field(ge=0.0, le=10.0)]


class Conflict(Strict):
    """A cut-in, a cut-out or a braking leader; Ve is the ego's speed at its start."""

    kind: Literal["cut_in", "cut_out", "braking"]
    other_speed_mps: Speed | None = Field(
        default=None, description="cut_in: Vo, along the lane"
    )
    gap_m: Gap | None = Field(
        default=None,
        description="cut_in: dx0, between the bumpers when the lateral speed is "
        "reached (quintic: when the lane change begins); cut_out: dx0_f, from the "
        "leader's front to the standing vehicle",
    )
    lateral_speed_mps: LateralSpeed | None = Field(
        default=None, description="Vy of the vehicle that changes its lane"
    )
    deceleration_mps2: Rate | None = Field(
        default=None, description="braking: of the leader, until it stands"
    )
    following_gap_m: Gap | None = Field(
        default=None,
        description="cut_out, braking: from the ego to its leader; null: 2 s",
    )
    profile: Literal["linear", "quintic"] = Field(
        default="linear",
        description="lateral motion of a cut-in: at constant lateral speed, or with "
        "least jerk from lane to lane, where Vy is the greatest speed",
    )
    side: Literal["left", "right"] = Field(
        default="right", description="from or to which the lane is changed"
    )
    follower: bool = Field(
        default=False, description="a vehicle behind the ego that reacts (IDM)"
    )
    length_m: Size = Field(default=4.3, description="of the other vehicles")
    width_m: Size = Field(default=1.9, description="of the other vehicles")

    @model_validator(mode="after")
    def _fits_kind(self) -> Self:
        """Reject a conflict that lacks a number or has one of another kind."""
        numbers = {name for names in ALLOWED.values() for name in names}
        for name in sorted(numbers):
            given = getattr(self, name) is not None
            if given and name not in ALLOWED[self.kind]:
                allowed = ", ".join(ALLOWED[self.kind])
                raise mismatch(name, f"is not for {self.kind}; allowed: {allowed}")
            if not given and name in NEEDED[self.kind]:
                raise mismatch(name, f"is missing; {self.kind} needs it")
        if self.kind == "cut_out" and self.lateral_speed_mps == 0.0:
            raise mismatch("lateral_speed_mps", "is 0; allowed: more than 0")
        if self.kind != "cut_in" and self.profile != "linear":
            raise mismatch("profile", f"is not for {self.kind}; allowed: linear")
        return self
