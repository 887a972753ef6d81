"""Study of [Thesis] ch. 5: path planners on the same fields of obstacles.

A method is any function from a field to `MethodPath`; all are measured by the same
functions, on the published layouts and on random ones. `python -m
experiments.thesis.dense.methods` prints the tables.
"""

import math
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table

from experiments.thesis.dense.layouts import (
    DIFFERENT_SIZES,
    EFFECTIVENESS,
    EGO_RADIUS,
    HALF_WIDTH,
    LENGTH,
    SAME_SIZE,
    PublishedLayout,
    random_layout,
)
from planner.dense.field import Cover, FrenetObstacles, straight_field
from planner.dense.frenet_path import FrenetPath
from planner.dense.lattice.coarse_path import PathStart
from planner.dense.lattice_methods import LatticePlan, plan_adaptive, plan_uniform
from planner.dense.settings import (
    EdgeChecks,
    LatticeSettings,
    SideSettings,
    SmoothingSettings,
    thesis_lattice,
    thesis_sides,
)
from planner.dense.sides.sequences import plan_sides
from planner.states import FloatArray

SUBDIVISION = 8  # of knot intervals, for integrals and extremes
COST_ROUNDING = 1e-6  # relative, of solvers
REPETITIONS = 3  # of each timed call; the fastest counts
COVER = Cover.single(EGO_RADIUS)
START = PathStart(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class MethodPath:
    """Result of a method; without a lattice there are no edges."""

    path: FrenetPath | None
    status: str
    edges: int = 0
    collision_edges: int = 0


Method = Callable[[FrenetObstacles], MethodPath]


@dataclass(frozen=True, slots=True)
class Measured:
    """One method on one layout; path columns are nan where there is no path."""

    method: str
    status: str
    solved: bool
    length: float  # in the plane, on the straight road [m]
    max_heading: float  # [rad]
    max_curvature: float  # [1/m]
    mean_l2: float  # over s [m²]
    thesis_cost: float  # eq. 5.27 without its first term, by integrals
    edges: int
    collision_edges: int
    run_time: float  # [ms]

    @property
    def effectiveness(self) -> float:
        """Share of edges free of collisions; [Thesis] eq. 5.33."""
        return 1.0 - self.collision_edges / max(self.edges, 1)


def lattice_method(
    plan: Callable[..., LatticePlan],
    lattice: LatticeSettings | None = None,
    smoothing: SmoothingSettings | None = None,
) -> Method:
    """Build a method of the study from a lattice planner; all its edges are checked."""
    lattice = replace(lattice or LatticeSettings(), edge_checks=EdgeChecks.ALL)
    smoothing = smoothing or SmoothingSettings()

    def method(field: FrenetObstacles) -> MethodPath:
        """Plan along the whole road."""
        planned = plan(field, COVER, START, LENGTH, lattice, smoothing)
        path = planned.path if planned.status == "ok" else None
        search = planned.search
        return MethodPath(
            path, str(planned.status), search.edges, search.collision_edges
        )

    return method


def sides_method(settings: SideSettings) -> Method:
    """Build a method of the study from the side sequences.

    They have no edges: what is collision-free by construction has nothing to throw
    away.
    """

    def method(field: FrenetObstacles) -> MethodPath:
        """Plan along the whole road."""
        found = plan_sides(field, COVER, START, LENGTH, settings)
        best = found.best
        return MethodPath(None if best is None else best.path, str(found.status))

    return method


SIDES = "sides"  # with the weights of this project
SIDES_PRINTED = "sides, printed weights"

METHODS: Mapping[str, Method] = {
    "uniform": lattice_method(plan_uniform),
    "adaptive": lattice_method(plan_adaptive),
    SIDES: sides_method(SideSettings()),
    SIDES_PRINTED: sides_method(thesis_sides()),
}

# The printed lattice, eq. 5.4 and 5.22 as they stand: shown on the two layouts.
PRINTED: Mapping[str, Method] = {
    "adaptive, as printed": lattice_method(plan_adaptive, thesis_lattice()),
}


def path_metrics(path: FrenetPath) -> tuple[float, float, float, float, float]:
    """Measure a path on a straight road.

    Args:
        path: Of any method.

    Returns:
        (length [m], largest heading [rad], largest curvature [1/m], mean l² [m²],
        thesis cost: w7 int l'² + l''² + l'''² ds + w8 int l² ds).
    """
    fine = path.subdivided(SUBDIVISION)
    s, slope = fine.s, fine.slope
    curvature = fine.second / (1.0 + slope**2) ** 1.5
    offset = _integral(fine.l**2, s)
    third = np.diff(path.second) / np.diff(path.s)
    smooth = _integral(slope**2 + fine.second**2, s)
    smooth += float(np.sum(third**2 * np.diff(path.s)))
    weights = SmoothingSettings()
    return (
        _integral(np.hypot(1.0, slope), s),
        float(np.abs(np.arctan(slope)).max()),
        float(np.abs(curvature).max()),
        offset / float(s[-1] - s[0]),
        weights.smoothness_weight * smooth + weights.offset_weight * offset,
    )


def _integral(values: FloatArray, s: FloatArray) -> float:
    """Integrate by the trapezoidal rule."""
    return float(np.trapezoid(values, s))


def measure(name: str, method: Method, obstacles: FloatArray) -> Measured:
    """Run one method on one layout.

    Args:
        name: Of the method.
        method: See there.
        obstacles: (s, l, r_ob) in rows, (n, 3) [m].
    """
    field = straight_field(obstacles, HALF_WIDTH, LENGTH)
    return measured(name, *timed(method, field, REPETITIONS))


def timed(
    method: Method, field: FrenetObstacles, repetitions: int
) -> tuple[MethodPath, float]:
    """Run a method several times and return (result, shortest time [ms])."""
    took = math.inf
    for _ in range(repetitions):
        start = time.perf_counter()
        result = method(field)
        took = min(took, time.perf_counter() - start)
    return result, 1e3 * took


def measured(name: str, result: MethodPath, run_time: float) -> Measured:
    """Measure the result of a method."""
    metrics = (math.nan,) * 5 if result.path is None else path_metrics(result.path)
    return Measured(
        name,
        result.status,
        result.path is not None,
        *metrics,
        result.edges,
        result.collision_edges,
        run_time,
    )


def measure_random(
    n: int,
    seeds: Iterable[int],
    *,
    same_size: bool,
    methods: Mapping[str, Method] = METHODS,
) -> dict[str, list[Measured]]:
    """Run all methods on the same random layouts; lists are in the order of seeds."""
    rows: dict[str, list[Measured]] = {name: [] for name in methods}
    for seed in seeds:
        obstacles = random_layout(n, seed=seed, same_size=same_size)
        for name, method in methods.items():
            rows[name].append(measure(name, method, obstacles))
    return rows


def share_better(
    rows: Sequence[Measured], rivals: Sequence[Measured], columns: Sequence[str]
) -> tuple[int, int]:
    """Count layouts in which a method beats another in all columns at once.

    Args:
        rows: Of the method.
        rivals: Of the other, on the same layouts.
        columns: Names of `Measured`; smaller is better.

    Returns:
        (times better, times that both have a path).
    """
    both = [(a, b) for a, b in zip(rows, rivals, strict=True) if a.solved and b.solved]
    better = sum(all(getattr(a, c) < getattr(b, c) for c in columns) for a, b in both)
    return better, len(both)


def layout_table(
    layout: PublishedLayout, methods: Mapping[str, Method] = METHODS
) -> Table:
    """Tabulate measured and published numbers of one layout."""
    table = Table(title=f"{layout.name}: measured (published)")
    for heading in ("method", "length m", "max heading rad", "max curvature 1/m"):
        table.add_column(heading)
    for heading in ("mean l² m²", "thesis cost", "edges", "collisions", "time ms"):
        table.add_column(heading, justify="right")
    for name, method in methods.items():
        row = measure(name, method, layout.array())
        old = layout.published.get(name)
        table.add_row(
            name,
            f"{row.length:.2f}" + (f" ({old.length:.2f})" if old else ""),
            f"{row.max_heading:.2f}" + (f" ({old.max_heading:.2f})" if old else ""),
            f"{row.max_curvature:.2f}",
            f"{row.mean_l2:.2f}",
            f"{row.thesis_cost:.0f}",
            str(row.edges),
            str(row.collision_edges),
            f"{row.run_time:.2f}" + (f" ({old.run_time:.0f})" if old else ""),
        )
    return table


SUMMARY = (
    ("length", "length m", 2),
    ("max_heading", "max heading rad", 3),
    ("max_curvature", "max curvature 1/m", 3),
    ("mean_l2", "mean l² m²", 2),
    ("thesis_cost", "thesis cost", 0),
)


def random_table(title: str, rows: Mapping[str, Sequence[Measured]]) -> Table:
    """Summarise random layouts; paths are compared where all methods have one."""
    table = Table(title=f"{title}: median / mean")
    table.add_column("")
    for name in rows:
        table.add_column(name, justify="right")
    groups = list(rows.values())
    table.add_row(
        "finds a path", *(f"{sum(r.solved for r in g)} of {len(g)}" for g in groups)
    )
    common = [all(r.solved for r in layout) for layout in zip(*groups, strict=True)]
    for column, words, digits in SUMMARY:
        cells = []
        for group in groups:
            kept = [getattr(r, column) for r, c in zip(group, common, strict=True) if c]
            cells.append(_middle(kept, digits))
        table.add_row(words, *cells)
    for column, words, digits in (
        ("edges", "edges", 0),
        ("collision_edges", "collision edges", 0),
        ("effectiveness", "effectiveness", 4),
        ("run_time", "time ms", 2),
    ):
        values = [[getattr(r, column) for r in group] for group in groups]
        table.add_row(words, *(_middle(group, digits) for group in values))
    return table


def _middle(values: Sequence[float], digits: int) -> str:
    """Write median and mean, a dash for no values."""
    if not values:
        return "-"
    return f"{np.median(values):.{digits}f} / {np.mean(values):.{digits}f}"


def sides_verdict(rows: Mapping[str, Sequence[Measured]]) -> str:
    """Count the layouts on which the side sequences keep their guarantees."""
    sides, printed, adaptive = (
        rows[name] for name in (SIDES, SIDES_PRINTED, "adaptive")
    )
    three, both = share_better(sides, adaptive, ("length", "max_heading", "mean_l2"))
    cheaper, also = 0, 0
    for one, other in zip(printed, adaptive, strict=True):
        if one.solved and other.solved:
            also += 1
            cheaper += one.thesis_cost <= other.thesis_cost * (1.0 + COST_ROUNDING)
    lost = sum(
        any(rows[name][k].solved for name in ("uniform", "adaptive")) and not one.solved
        for k, one in enumerate(sides)
    )
    return (
        f"sides: shorter, lower heading and less offset than adaptive at once in "
        f"{three} of {both}; with the printed weights at no higher thesis cost in "
        f"{cheaper} of {also}; layouts that only a lattice solves: {lost}"
    )


def main(n_layouts: int = 400, console: Console | None = None) -> None:
    """Print the study."""
    console = console or Console(highlight=False, width=110)
    for layout in (SAME_SIZE, DIFFERENT_SIZES):
        console.print(layout_table(layout, {**METHODS, **PRINTED}))
    for n in range(1, 5):
        for same_size in (True, False):
            rows = measure_random(n, range(n_layouts), same_size=same_size)
            sizes = "same size" if same_size else "different sizes"
            console.print(random_table(f"{n} obstacles, {sizes}", rows))
            better, both = share_better(
                rows["adaptive"], rows["uniform"], ("length", "max_heading")
            )
            console.print(
                f"adaptive shorter and with lower heading: {better} of {both} layouts "
                "that both solve"
            )
            console.print(sides_verdict(rows))
            told = {name: EFFECTIVENESS[name][n - 1] for name in EFFECTIVENESS}
            console.print(f"published (collision edges, effectiveness %): {told}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 400)
