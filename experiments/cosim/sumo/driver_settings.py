"""Settings of SUMO's own driver in the ego's place."""

from dataclasses import dataclass

HIGHEST = 100.0  # of the eagerness parameters: SUMO accepts any, more changes nothing


@dataclass(frozen=True, slots=True)
class SumoDriverSettings:
    """Lane-change parameters of the ego, as SUMO names them, and what it is told.

    Raises:
        ValueError: If one is out of range.
    """

    strategic: float = 1.0  # lcStrategic: scales how far ahead lanes are sorted out [-]
    assertive: float = 1.0  # lcAssertive: accepted gaps shrink by it [-]
    cooperative: float = 1.0  # lcCooperative: changes lanes for others, in [0, 1]
    speed_gain: float = 1.0  # lcSpeedGain: eagerness to change lanes to go faster [-]
    told: bool = True  # of a closure at the distance from which it is known
    # above 0: the sublane model (SL2015), for all of the traffic; strips this wide [m]
    lateral_resolution: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("strategic", "assertive", "speed_gain"):
            _check(name, getattr(self, name), HIGHEST)
        _check("cooperative", self.cooperative, 1.0)
        _check("lateral_resolution", self.lateral_resolution, 2.0)
        if self.assertive == 0.0:
            raise ValueError(f"assertive must be above 0 and at most {HIGHEST:g}")

    @property
    def parameters(self) -> dict[str, float]:
        """Names of SUMO's lane-change parameters, and their values."""
        return {
            "lcStrategic": self.strategic,
            "lcAssertive": self.assertive,
            "lcCooperative": self.cooperative,
            "lcSpeedGain": self.speed_gain,
        }


def _check(name: str, value: float, most: float) -> None:
    """Raise unless a value is between 0 and `most`."""
    if not 0.0 <= value <= most:
        raise ValueError(f"{name} must be between 0 and {most:g}")
