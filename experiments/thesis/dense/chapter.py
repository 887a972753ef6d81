"""Chapter 5 recomputed: Figures 5.1 and 5.7-5.10, Tables 5.2, 5.3 and 5.5."""

from itertools import product

from experiments.sweep.processes.parallel import Work
from experiments.thesis.claims import (
    Chapter,
)
from experiments.thesis.dense.claims import (
    comparison_claims,
    effectiveness_claims,
    sampling_claims,
    sensitivity_claims,
    time_claims,
)
from experiments.thesis.dense.figures import (
    PICKED,
    example_picture,
    path_pictures,
    sampling_pictures,
    waypoints_picture,
)
from experiments.thesis.dense.layouts import (
    HALF_WIDTH,
    LENGTH,
    PublishedLayout,
)
from experiments.thesis.dense.methods import (
    METHODS,
    PRINTED,
    REPETITIONS,
    Measured,
    measured,
    timed,
)
from experiments.thesis.dense.study import (
    RandomLayout,
    study,
)
from experiments.thesis.dense.tables import (
    COUNTS,
    Groups,
    paths_table,
    picked_table,
    sampling_table,
    sides_table,
    time_table,
)
from experiments.thesis.effort import Effort
from planner.dense.field import straight_field
from planner.dense.frenet_path import FrenetPath


def dense_chapter(effort: Effort, work: Work) -> Chapter:
    """Recompute chapter 5."""
    groups = _groups(effort, work)
    picked = {table: _picked(layout) for table, layout in PICKED.items()}
    rows = {t: {name: row for name, (row, _) in p.items()} for t, p in picked.items()}
    return Chapter(
        "dense",
        5,
        "Dense obstacles",
        {"random layouts for each number of obstacles": 2 * effort.dense_layouts},
        (
            *sensitivity_claims(groups),
            *sampling_claims(groups),
            *effectiveness_claims(groups),
            *comparison_claims(rows, groups),
        ),
        (
            *(picked_table(table, row) for table, row in rows.items()),
            sampling_table(groups),
            paths_table(groups),
        ),
        (sides_table(groups),),
        time_claims(rows),
        (time_table(rows, groups),),
        pictures=(
            *sampling_pictures(groups),
            waypoints_picture(),
            *path_pictures(picked),
            *example_picture(groups),
        ),
    )


def _groups(effort: Effort, work: Work) -> Groups:
    """Study the random layouts, by number and kind."""
    groups = {}
    for same, n in product((True, False), COUNTS):
        kind = "one size" if same else "different sizes"
        layouts = [RandomLayout(n, seed, same) for seed in range(effort.dense_layouts)]
        groups[n, same] = work.map(f"{n} obstacles, {kind}", study, layouts)
    return groups


def _picked(layout: PublishedLayout) -> dict[str, tuple[Measured, FrenetPath | None]]:
    """Run all methods on a picked layout."""
    field = straight_field(layout.array(), HALF_WIDTH, LENGTH)
    found = {}
    for name, method in {**METHODS, **PRINTED}.items():
        result, took = timed(method, field, REPETITIONS)
        found[name] = measured(name, result, took), result.path
    return found
