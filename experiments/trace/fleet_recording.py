"""Records a run with many egos, and makes its trace."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from experiments.cosim.fleet.records import FleetStep
from experiments.trace.fleet import FleetTrace, fleet_table
from experiments.trace.schema import Table
from planner.states import IntArray

NO_PLAN = (np.nan,) * 6


@dataclass(slots=True)
class FleetRecorder:
    """Keeps the steps of a run with many egos; the loop calls it with each."""

    _steps: list[FleetStep] = field(default_factory=list)
    _numbers: dict[str, int] = field(default_factory=dict)
    _columns: list[IntArray] = field(default_factory=list)

    def __call__(self, step: FleetStep) -> None:
        """Add one step."""
        known = self._numbers
        ids = step.snapshot.users.ids
        places = [known.setdefault(name, len(known)) for name in ids]
        self._columns.append(np.array(places, dtype=np.int64))
        self._steps.append(step)

    @property
    def n_steps(self) -> int:
        """Number of steps so far."""
        return len(self._steps)

    def trace(self, step: float, lanes: Sequence[str]) -> FleetTrace:
        """Return what was recorded.

        Args:
            step: Of the loop [s].
            lanes: Names of the lanes by their numbers.
        """
        steps = self._steps
        shots = [one.snapshot for one in steps]
        sizes = [len(one.users.ids) for one in shots]
        indices = np.array([one.index for one in steps], dtype=np.int64)
        nothing = np.empty(0, dtype=np.int64)
        return FleetTrace(
            step,
            tuple(self._numbers),
            tuple(lanes),
            np.repeat(indices, sizes),
            np.concatenate([nothing, *self._columns]),
            np.concatenate([nothing, *(one.group for one in steps)]),
            np.concatenate([nothing, *(one.lane for one in shots)]),
            np.hstack([np.empty((8, 0)), *(one.users.table for one in shots)]),
            np.hstack(
                [
                    np.empty((4, 0)),
                    *(
                        np.vstack([x.position, x.wished_speed, x.fuel, x.co2])
                        for x in shots
                    ),
                ]
            ),
            np.array([one.time for one in shots]),
            np.array([one.pending for one in shots], dtype=np.int64),
            np.array([one.cpu_s for one in steps]),
            indices,
            _ego_table(steps),
            np.array([x.planning_ms for one in steps for x in one.egos]),
            _end_table(steps),
            np.array([x.ahead or NO_PLAN for one in steps for x in one.egos]).reshape(
                -1, len(NO_PLAN)
            ),
        )


def _ego_table(steps: Sequence[FleetStep]) -> Table:
    """Return every ego in every step."""
    egos = [(step.index, one) for step in steps for one in step.egos]
    return fleet_table(
        "egos",
        [index for index, _ in egos],
        [x.id for _, x in egos],
        [x.group for _, x in egos],
        *(
            [getattr(x.ego, name) for _, x in egos]
            for name in ("x", "y", "heading", "curvature", "speed", "acceleration")
        ),
        [x.status or None for _, x in egos],
        [x.clearance if np.isfinite(x.clearance) else np.nan for _, x in egos],
        [x.off_road for _, x in egos],
        [json.dumps(x.contacts) for _, x in egos],
    )


def _end_table(steps: Sequence[FleetStep]) -> Table:
    """Return how egos ceased to be ones."""
    ends = [x for step in steps for x in step.leavings]
    names = ("index", "id", "how", "reason")
    return fleet_table("ego_ends", *([getattr(x, n) for x in ends] for n in names))
