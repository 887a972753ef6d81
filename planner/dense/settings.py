"""Parameters of the lattice methods and of the smoothing; [Thesis] table 5.1."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from planner.errors import InvalidInputError
from planner.states import store_floats


class LayerRule(StrEnum):
    """Where between obstacles the free layers lie."""

    EVEN = "even"  # the gap in equal parts of at least the layer step
    PRINTED = "printed"  # [Thesis] eq. 5.4: every layer step after an obstacle


class GateReach(StrEnum):
    """Part of an obstacle that closes a region; "in" in [Thesis] eq. 5.6."""

    INFLATED = "inflated"  # its disc grown by the ego's
    BODY = "body"  # its disc
    CENTRE = "centre"  # its centre only


class SafetyCost(StrEnum):
    """How nearness to obstacles is priced."""

    CLEARANCE = "clearance"  # additive over edges, on the gap to the obstacle's edge
    PRINTED = "printed"  # [Thesis] eq. 5.22, for each edge


class EdgeChecks(StrEnum):
    """Which edges are checked; the cheapest chain is the same."""

    NEEDED = "needed"  # those that can become the cheapest way to their end
    ALL = "all"  # as in [Thesis] 5.5, for the effectiveness of table 5.2


KNOT_STEPS = (0.1, 5.0)  # of a path [m]
PATH_SOLVERS = ("riccati", "piqp", "daqp", "proxqp", "clarabel")


def _check_solver(name: str) -> None:
    """Refuse a solver that is not there."""
    if name not in PATH_SOLVERS:
        allowed = ", ".join(PATH_SOLVERS)
        raise InvalidInputError(f"solver = {name}; allowed: {allowed}")


def _require(record: object, positive: tuple[str, ...], zero: tuple[str, ...]) -> None:
    """Refuse numbers that are not positive, or not even zero."""
    for name in positive:
        if not getattr(record, name) > 0.0:
            raise InvalidInputError(f"{name} = {getattr(record, name)} must be > 0")
    for name in zero:
        if not getattr(record, name) >= 0.0:
            raise InvalidInputError(f"{name} = {getattr(record, name)} must be >= 0")


def _within(record: object, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Refuse numbers outside of what a cycle can work with."""
    for name, (low, high) in ranges.items():
        value = getattr(record, name)
        if not low <= value <= high:
            raise InvalidInputError(
                f"{name} = {value} must lie between {low:g} and {high:g}"
            )


@dataclass(frozen=True, slots=True)
class LatticeSettings:
    """Waypoints, edges and their costs; the weights are those of [Thesis] table 5.1."""

    uniform_layers: int = 7  # of the conventional method [104]
    free_points: int = 15  # on a layer that no obstacle set
    layer_step: float = 10.0  # dq: from this gap on there are layers between [m]
    merge_distance: float = 2.0  # obstacles closer than this share a layer [m]
    layer_rule: LayerRule = LayerRule.EVEN
    regions: int = 20  # m
    resolution: int = 4  # U, waypoints in a region far from obstacles
    gate_reach: GateReach = GateReach.INFLATED
    narrow_strips: bool = True  # a waypoint also where no region is open to the full
    position_weight: float = 0.8  # w0 [1/m]
    size_weight: float = 1.0  # w1; cancels in eq. 5.11
    distance_weight: float = 0.04  # w2; cancels in eq. 5.11
    sample_step: float = 1.0  # between the checked points of an edge [m]
    edge_checks: EdgeChecks = EdgeChecks.NEEDED
    margin: float = 0.0  # room kept beyond the discs [m]
    max_curvature: float = 0.5  # k_max [1/m]
    offset_weight: float = 0.3  # w3
    smoothness_weight: float = 0.4  # w4
    safety_weight: float = 0.3  # w5
    safety_cost: SafetyCost = SafetyCost.CLEARANCE
    clearance: float = 1.5  # gap from which on an obstacle costs nothing [m]

    def __post_init__(self) -> None:
        """Refuse what cannot be sampled."""
        store_floats(self)
        whole = ("uniform_layers", "free_points", "regions", "resolution")
        lengths = ("layer_step", "sample_step", "max_curvature", "clearance")
        weights = ("offset_weight", "smoothness_weight", "safety_weight")
        map_weights = ("position_weight", "size_weight", "distance_weight")
        _require(
            self,
            (*whole, *lengths, *map_weights),
            ("merge_distance", "margin", *weights),
        )
        counts = {"uniform_layers": (1, 100), "free_points": (1, 200)}
        steps = {"layer_step": (0.5, 100.0), "sample_step": (0.05, 10.0)}
        _within(self, {**counts, **steps, "regions": (1, 200), "resolution": (1, 50)})


def thesis_lattice() -> LatticeSettings:
    """Make the printed lattice, as far as it is computable: eq. 5.4 and 5.22."""
    return LatticeSettings(
        layer_rule=LayerRule.PRINTED,
        merge_distance=0.0,
        narrow_strips=False,
        edge_checks=EdgeChecks.ALL,
        safety_cost=SafetyCost.PRINTED,
    )


@dataclass(frozen=True, slots=True)
class SmoothingSettings:
    """The quadratic program of [Thesis] eq. 5.27 to 5.32."""

    knot_step: float = 0.5  # [m]
    coarse_weight: float = 1500.0  # w6
    smoothness_weight: float = 1000.0  # w7
    offset_weight: float = 100.0  # w8
    max_curvature: float = 0.5  # k_max [1/m]
    turn_margin: float = 0.02  # covers what linearising the turning body leaves [m]
    allowed_slack: float = (
        0.0  # by which a path may leave its tube if none is in it [m]
    )
    passes: int = 3  # linearisations, at most
    solver: str = "riccati"

    def __post_init__(self) -> None:
        """Refuse what is no program."""
        store_floats(self)
        _require(
            self,
            ("knot_step", "smoothness_weight", "max_curvature", "passes"),
            ("coarse_weight", "offset_weight", "turn_margin", "allowed_slack"),
        )
        _within(self, {"knot_step": KNOT_STEPS, "passes": (1, 20)})
        _check_solver(self.solver)


@dataclass(frozen=True, slots=True)
class SideSettings:
    """Side sequences: one quadratic program each, the cheapest wins.

    The default weights are chosen so that paths are short and bend little at once; the
    printed ones, `thesis_sides`, price a metre of offset higher.
    """

    knot_step: float = 0.5  # [m]
    offset_weight: float = 4.0  # of l² [1/m²]
    slope_weight: float = 100.0  # of l'²
    bend_weight: float = 100.0  # of l''² [m²]
    jerk_weight: float = 100.0  # of l'''² [m⁴]
    in_plane: bool = False  # l'' and l''' with the road's own curvature
    max_curvature: float = 0.5  # k_max [1/m]
    turn_margin: float = 0.02  # covers what linearising the turning body leaves [m]
    margin: float = 0.0  # room kept beyond the discs [m]
    alternatives: int = 1  # sequences kept besides the cheapest
    max_programs: int = 200  # solved in one search, at most
    passes: int = 3  # linearisations of the winner, at most
    solver: str = "riccati"  # of the winner

    def __post_init__(self) -> None:
        """Refuse what is no program."""
        store_floats(self)
        weights = ("offset_weight", "slope_weight", "bend_weight")
        _require(
            self,
            ("knot_step", "jerk_weight", "max_curvature", "max_programs", "passes"),
            (*weights, "turn_margin", "margin", "alternatives"),
        )
        counts = {"alternatives": (0, 10), "max_programs": (1, 100_000)}
        _within(self, {"knot_step": KNOT_STEPS, "passes": (1, 20), **counts})
        _check_solver(self.solver)


def thesis_sides() -> SideSettings:
    """Price paths as [Thesis] eq. 5.27 to 5.29 with the weights of table 5.1."""
    return SideSettings(
        offset_weight=100.0, slope_weight=1000.0, bend_weight=1000.0, jerk_weight=1000.0
    )


# For driving, v²κ and its rate are priced: a path bends little and evenly. ∫ (v²κ)² and
# ∫ (v³κ')² ds at 8 m/s, at 7.3 and 3.8 for an offset of 1 m², are 30 000 l''² and
# 1 000 000 l'''². Prices that grow with the target speed change paths by little.
SMOOTH_SIDES = SideSettings(
    offset_weight=1.0, bend_weight=3e4, jerk_weight=1e6, in_plane=True, max_programs=80
)


class PathMethod(StrEnum):
    """Which path planner is driven."""

    SIDE_SEQUENCES = "side_sequences"
    ADAPTIVE = "adaptive"  # [Thesis] 5.3-5.6
    UNIFORM = "uniform"  # the conventional method [104]


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """The speed along the path."""

    duration: float = 6.0  # T [s]
    time_step: float = 0.1  # between knots [s]
    distance_weight: float = 0.5  # of the place against the reference [1/m²]
    speed_weight: float = 2.0
    acceleration_weight: float = 0.5
    jerk_weight: float = 0.5
    max_jerk: float = 5.0  # [m/s³]
    acceleration: float = 1.5  # of the reference [m/s²]
    braking: float = 1.5  # of the reference, towards bends and the end [m/s²]
    lateral_share: float = 0.5  # of the vehicle's limit, of the reference
    lateral_jerk: float = 4.0  # of the reference [m/s³]
    headway: float = 0.8  # to a vehicle ahead [s]
    vehicle_gap: float = 2.5  # kept to it along the path [m]
    attempts: int = 4  # with a slower reference each, where bends are taken too fast

    def __post_init__(self) -> None:
        """Refuse what is no program."""
        store_floats(self)
        positive = ("duration", "time_step", "jerk_weight", "max_jerk", "attempts")
        rates = ("acceleration", "braking", "lateral_share", "lateral_jerk")
        weights = ("distance_weight", "speed_weight", "acceleration_weight")
        _require(self, (*positive, *rates), (*weights, "headway", "vehicle_gap"))
        _within(self, {"duration": (1.0, 30.0), "time_step": (0.05, 0.5)})
        _within(self, {"lateral_share": (0.0, 1.0), "attempts": (1, 20)})


@dataclass(frozen=True, slots=True)
class DenseSettings:
    """Everything that can be set of the planner in closed loop."""

    method: PathMethod = PathMethod.SIDE_SEQUENCES
    horizon: float = 60.0  # of the path, at least [m]
    margins: tuple[float, ...] = (0.4, 0.2, 0.05)  # to obstacles, the widest first [m]
    road_margin: float = 0.1  # of the body to the road's edge [m]
    curvature_share: float = 0.9  # of the vehicle's limit that paths use
    stop_gap: float = 1.4  # to what blocks the way [m]
    change_gain: float = 0.15  # share of its cost that other sides must save
    spacing: int = 2  # points of the path a knot interval
    firm_share: float = 0.75  # of the vehicle's limits, where comfort leaves no way
    sides: SideSettings = SMOOTH_SIDES
    lattice: LatticeSettings = LatticeSettings()
    smoothing: SmoothingSettings = SmoothingSettings()
    drive: DriveSettings = DriveSettings()

    def __post_init__(self) -> None:
        """Refuse what cannot be driven."""
        store_floats(self)
        positive = ("horizon", "curvature_share", "firm_share", "spacing")
        _require(self, positive, ("stop_gap", "change_gain", "road_margin"))
        _within(self, {"horizon": (20.0, 500.0), "spacing": (1, 20)})
        shares = {"curvature_share": (0.0, 1.0), "firm_share": (0.0, 1.0)}
        _within(self, {**shares, "road_margin": (0.0, 2.0)})
        _within(self, {"stop_gap": (0.0, 20.0), "change_gain": (0.0, 1.0)})
        margins = self.margins
        if not margins or min(margins) < 0.0 or tuple(sorted(margins)[::-1]) != margins:
            raise InvalidInputError(
                f"margins = {margins} must be one or more, >= 0, the widest first"
            )
