"""Parameters of the lane-change planner."""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache

from planner.states import store_floats
from planner.vehicle import Vehicle, held_to


@dataclass(frozen=True, slots=True)
class PathSettings:
    """How paths are made and priced."""

    spacing: float = 1.0  # of the points along the road [m]
    change_times: tuple[float, ...] = (3.0, 4.0, 5.0, 6.5)  # length over speed [s]
    # of a change at walking speed: the usual one, and out of a narrow place [m]
    min_lengths: tuple[float, ...] = (18.0, 13.0, 9.0)
    c_ratios: tuple[float, ...] = (0.15, 0.2, 0.3)  # place of C over the length [-]
    curvature_weight: float = 4000.0  # of the integral of squared curvature [m]
    length_weight: float = 0.02  # [1/m]
    curvature_share: float = 0.9  # of the vehicle's limit that is used [-]
    lateral_acceleration: float = 2.0  # of the change itself [m/s²]
    settle_time: float = 3.0  # in which lane keeping returns to the centre [s]
    settle_length: float = 20.0  # and over at least this [m]

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)


class OrderRule(StrEnum):
    """How a passing order is chosen."""

    SOLVE_ALL = "solve_all"  # every order that can be reached is solved
    AREA = "area"  # [Thesis] eq. 6.12-6.18
    DYNAMIC_PROGRAMMING = "dynamic_programming"  # DP&QP, the conventional method


@dataclass(frozen=True, slots=True)
class GridSettings:
    """The grid of the conventional search."""

    times: int = 17
    places: int = 321


@dataclass(frozen=True, slots=True)
class PrintedPieces:
    """Pieces of the thesis' speed planning as printed; see `speed.printed`."""

    four_corners: bool = False  # 6.4.1: on the path if all corners are near it
    corner_distance: float = 1.75  # omega, which is not given: half a lane [m]
    region_bounds: bool = False  # 6.13-6.17 bound the program
    objective: bool = False  # 6.20: distance and speed themselves are minimised


@dataclass(frozen=True, slots=True)
class SpeedSettings:
    """The speed program, [Thesis] eq. 6.19 and 6.20 corrected, and its margins."""

    duration: float = 10.0  # T [s]
    step: float = 0.1  # between knots [s]
    distance_weight: float = 0.05  # w3
    speed_weight: float = 1.0  # w4
    acceleration_weight: float = 2.0  # w5
    jerk_weight: float = 4.0  # w6
    max_jerk: float = 5.0  # [m/s³]
    along_margin: float = 1.0  # between footprints [m]
    across_margin: float = 0.3  # [m]
    lateral_acceleration: float = 2.2  # up to which it goes through bends [m/s²]
    front_gap: float = 2.0  # d0 to a vehicle ahead, beyond the margin [m]
    front_headway: float = 0.8  # tau to it [s]
    rear_gap: float = 1.0  # d0 to a vehicle behind, beyond the margin [m]
    rear_headway: float = 1.1  # tau of it [s]
    relax_time: float = 8.0  # in which a gap that is too short now is opened [s]
    max_orders: int = 64  # passing orders looked at in one plan
    order_rule: OrderRule = OrderRule.SOLVE_ALL
    grid: GridSettings = GridSettings()  # of rule dynamic_programming
    printed: PrintedPieces = PrintedPieces()

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)


class GapRule(StrEnum):
    """How the place of a change is chosen."""

    HORIZON = "horizon"  # every gap near the ego is rolled out over half a minute
    PLACES = "places"  # speed plans from `starts`, the cheapest within their duration


@dataclass(frozen=True, slots=True)
class GapSettings:
    """The choice of a gap, with its future in mind; see `gaps.rollout`."""

    rule: GapRule = GapRule.HORIZON
    horizon: float = 32.0  # [s]
    step: float = 0.5  # of the rollouts [s]
    gaps_ahead: int = 3  # looked at, beside the one beside the ego
    gaps_behind: int = 3
    line_time: float = 1.5  # from the begin of a change until the body enters [s]
    aside_time: float = 2.5  # a change before a blockage begins as much earlier [s]
    acceleration: float = 1.2  # of the ego while it adjusts [m/s²]
    braking: float = 1.5  # [m/s²]
    sight: float = 120.0  # behind the ego; who comes from farther is not seen [m]
    front_headway: float = 0.3  # to the vehicle ahead when the body enters [s]
    opened_headway: float = 0.6  # to which it is opened during the change [s]
    rear_headway: float = 0.3  # of the one behind, who is predicted to yield [s]
    reaction: float = 1.0  # of the one behind, for RSS [s]
    # that the ego promises not to exceed while it changes, for RSS [m/s²]
    promised_braking: float = 3.5
    yielding: float = 1.0  # braking that is predicted of it [m/s²]
    # of the change itself where there is room; `path.lateral_acceleration` where a
    # change that needs no more leads nowhere [m/s²]
    lateral_acceleration: float = 1.0
    braking_weight: float = 2.5  # of braking behind [s per m/s²]
    missing_weight: float = 0.5  # of what a gap is too short now [s/m]
    most_missing: float = 12.0  # a gap that lacks more is none [m]
    wait_weight: float = 0.4  # of each second before the change [-]
    room_weight: float = 3.0  # of having no room left before a blockage [s]
    room_scale: float = 150.0  # with as much there is enough [m]
    effort_weight: float = 0.02  # of the ego's squared acceleration [s⁴/m²]
    keep_gain: float = 0.4  # by which another gap must be better [s]

    @property
    def n_times(self) -> int:
        """Number of times of a rollout."""
        return round(self.horizon / self.step) + 1

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)


@dataclass(frozen=True, slots=True)
class ManoeuvreSettings:
    """When to change, and what has to be true before the body enters the lane."""

    gain: float = 0.5  # advantage that is worth a change [m/s]
    starts: tuple[float, ...] = (0.0, 15.0, 30.0, 50.0, 80.0)  # of a change ahead [m]
    start_weight: float = 0.3  # cost of each metre that a change is put off [1/m]
    pull_out_room: float = 16.0  # kept to a blockage while waiting beside it [m]
    tight_room: float = 7.0  # from which a stand still leads past a blockage [m]
    reaction: float = 0.6  # of the driver behind, for RSS [s]
    rear_braking: float = 4.5  # of the driver behind, for RSS [m/s²]
    rss_gate: bool = True  # whether a gap must be safe by RSS before it is entered
    consistent: bool = True  # whether a change, once begun, goes on on its path

    def __post_init__(self) -> None:
        """Store whole numbers as floats."""
        store_floats(self)


@dataclass(frozen=True, slots=True)
class LaneChangeSettings:
    """Everything that can be set."""

    path: PathSettings = PathSettings()
    speed: SpeedSettings = SpeedSettings()
    manoeuvre: ManoeuvreSettings = ManoeuvreSettings()
    gaps: GapSettings = GapSettings()

    @property
    def rear_reaction(self) -> float:
        """Reaction time of the driver behind, for RSS [s]."""
        if self.gaps.rule is GapRule.PLACES:
            return self.manoeuvre.reaction
        return self.gaps.reaction

    def promised_braking(self, service: float) -> float:
        """Return the braking that the ego promises in a change, for RSS [m/s²].

        Args:
            service: Its service braking [m/s²].
        """
        if self.gaps.rule is GapRule.PLACES:
            return service
        return min(self.gaps.promised_braking, service)

    def in_change(self, vehicle: Vehicle) -> Vehicle:
        """Return the vehicle with the braking that plans of a change are held to."""
        service = vehicle.limits.max_deceleration
        return held_to(vehicle, self.promised_braking(service))

    @property
    def calm_path(self) -> PathSettings:
        """Path settings of a change where there is room."""
        lateral = min(self.gaps.lateral_acceleration, self.path.lateral_acceleration)
        return _with_lateral(self.path, lateral)

    @property
    def entering(self) -> SpeedSettings:
        """Speed settings until the body enters a gap: as short as gaps may be."""
        return self._with_headway(self.gaps.front_headway)

    @property
    def committed(self) -> SpeedSettings:
        """Speed settings inside a gap, which is opened ahead."""
        return self._with_headway(self.gaps.opened_headway)

    def _with_headway(self, front: float) -> SpeedSettings:
        """Return speed settings with the headways of a change."""
        if self.gaps.rule is GapRule.PLACES:
            return self.speed
        return _with_headways(
            self.speed,
            min(front, self.speed.front_headway),
            min(self.gaps.rear_headway, self.speed.rear_headway),
        )


# Settings are asked for in every cycle, and checked when they are made.
@lru_cache(maxsize=16)
def _with_lateral(path: PathSettings, lateral: float) -> PathSettings:
    """Return path settings with another lateral acceleration."""
    return replace(path, lateral_acceleration=lateral)


@lru_cache(maxsize=16)
def _with_headways(speed: SpeedSettings, front: float, rear: float) -> SpeedSettings:
    """Return speed settings with other headways."""
    return replace(speed, front_headway=front, rear_headway=rear)
