"""The same traffic, the same seed, and no ego: what would have happened to the others.

Up to the ego's entry both runs are the same, but for one step of every entry that was
taken back. From there on vehicles also differ by chance: drivers that dawdle (Krauss)
draw from random numbers of their lane, of which an ego takes its share. How much that
is, two placebos show against each other: the same run again, each with other random
numbers from the entry on. SUMO does not go on from a saved state quite as it would have
without (lane changes under way end at once), but the same way in both.
"""

from collections.abc import Hashable, Iterator, Set
from dataclasses import replace
from pathlib import Path

from experiments.cosim.records import TrafficState
from experiments.cosim.sumo.closed_lanes import close_to_traffic
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.settings import SumoSettings, command_line
from experiments.cosim.sumo.sumo_errors import sumo_errors
from experiments.cosim.sumo.world import SumoWorld

STATE_FILE = "state_at_entry.xml"


class WithoutEgoWorld(SumoWorld):
    """A SUMO world in which the ego never enters; the slow leader does.

    Args:
        settings: Those of the world with the ego.
        placebo_seed: Of the random numbers from the entry on; None: go on.
        folder: Where the state at the entry is kept meanwhile, for a placebo.
    """

    def __init__(
        self,
        settings: SumoSettings,
        placebo_seed: int | None = None,
        folder: Path | None = None,
    ) -> None:
        super().__init__(settings)
        self._placebo_seed = placebo_seed
        self._folder = folder

    @property
    def traffic(self) -> Hashable:
        """What the planner's choice can change of this run, besides the scenario.

        Worlds of one scenario in which it is equal report the same, bit by bit.
        """
        settings = replace(self._settings, route_file=Path())
        demand = self._settings.route_file.read_bytes()
        return (*command_line(settings), demand, settings.closed, self._placebo_seed)

    def drive(
        self, entry_steps: int, n_steps: int, ids: Set[str] | None = None
    ) -> Iterator[TrafficState]:
        """Run the traffic without the ego.

        Args:
            entry_steps: Steps after the warm-up until the ego would enter.
            n_steps: Moments to report, the first is that entry.
            ids: Of the vehicles reported, wherever they are; None: of all.

        Yields:
            A state for each moment.

        Raises:
            SimulationError: If SUMO fails.
        """
        sumo, (_, *others) = self._set_up()
        reader = self._reading()
        with sumo_errors(sumo, "running without the ego"):
            for step in range(1, entry_steps + 1):
                if step == entry_steps:
                    for one in others:
                        one.ask(sumo)
                sumo.simulationStep()
            if self._placebo_seed is not None and self._folder is not None:
                self._start_anew(sumo, self._placebo_seed, self._folder / STATE_FILE)
            for moment in range(n_steps):
                if moment > 0:
                    self._move_drivers()
                    sumo.simulationStep()
                there = sumo.vehicle.getIDList()
                found = reader.of(there if ids is None else ids & set(there))
                yield TrafficState(moment * self.step, found)

    def _start_anew(self, sumo: Libsumo, seed: int, file: Path) -> None:
        """Go on from the present state with other random numbers."""
        sumo.simulation.saveState(str(file))
        sumo.close()
        command = command_line(replace(self._settings, seed=seed))
        sumo.start([*command, "--load-state", str(file)])
        file.unlink()
        if self._settings.closed.disallowed:
            close_to_traffic(sumo, self._settings.closed.lanes)
