"""The metrics of an episode: every column of the results row, in its order.

The entries are listed by group in `experiments.metrics.groups`. The row, the tables on
the terminal and on pages, the default metrics of a comparison and the reference in the
documentation are all derived from this list.
`python -m experiments.metrics.catalogue` prints the reference as Markdown.
"""

import sys
from collections.abc import Mapping
from typing import Final

from experiments.metrics import columns
from experiments.metrics.fleet_catalogue import FLEET_METRICS
from experiments.metrics.groups.comfort import COMFORT
from experiments.metrics.groups.computation import COMPUTATION
from experiments.metrics.groups.driving import EFFICIENCY, RULES
from experiments.metrics.groups.identity import IDENTITY
from experiments.metrics.groups.lane_change import LANE_CHANGE
from experiments.metrics.groups.others import CAUSAL, FOLLOWERS, WITHOUT_EGO
from experiments.metrics.groups.safety import SAFETY
from experiments.metrics.groups.tracking import TRACKING
from experiments.metrics.groups.world import WORLD
from experiments.metrics.metric import Metric

METRICS: Final[Mapping[str, Metric]] = {
    metric.column: metric
    for metric in (
        *IDENTITY,
        *SAFETY,
        *EFFICIENCY,
        *RULES,
        *COMFORT,
        *COMPUTATION,
        *FOLLOWERS,
        *LANE_CHANGE,
        *WITHOUT_EGO,
        *CAUSAL,
        *TRACKING,
        *FLEET_METRICS,
        *WORLD,
    )
}
# what others do because of the ego: null where they follow a recording
REACTIONS: Final = frozenset(
    {
        columns.REAR_MAX_DECELERATION,
        columns.REAR_SPEED_LOSS,
        columns.CUT_IN_DECELERATION,
    }
)
ALL_COLUMNS: Final = tuple(METRICS)
TIMING_COLUMNS: Final = tuple(m.column for m in METRICS.values() if m.timing)
IN_TERMINAL: Final = tuple(m for m in METRICS.values() if m.in_terminal)
# share of runs with a value above zero -> its column
RATES: Final[Mapping[str, str]] = {m.rate: m.column for m in METRICS.values() if m.rate}
MEANS: Final = tuple(m.column for m in METRICS.values() if m.compared and not m.rate)


def markdown_table() -> str:
    """Return the reference of all metrics as a Markdown table."""
    lines = [
        "| column | label | unit | better | default in | definition |",
        "|---|---|---|---|---|---|",
    ]
    for metric in METRICS.values():
        shown = [
            name
            for name, is_in in (
                ("run", metric.in_terminal),
                ("compare", metric.compared),
            )
            if is_in
        ]
        formula = metric.formula.replace("|", "\\|")
        lines.append(
            f"| `{metric.column}` | {metric.label} | {metric.unit or '-'} "
            f"| {metric.better} | {', '.join(shown) or '-'} | {formula} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(markdown_table())
