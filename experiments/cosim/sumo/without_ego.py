"""The same traffic, the same seed, and no ego: what would have happened to the others.

Up to the ego's entry both runs are the same, but for one step of every entry that was
taken back. From there on vehicles also differ by chance: drivers that dawdle (Krauss)
draw from random numbers of their lane, of which an ego takes its share.
"""

from collections.abc import Iterator, Set

from experiments.cosim.records import TrafficState
from experiments.cosim.sumo.world import SumoWorld, sumo_errors


class WithoutEgoWorld(SumoWorld):
    """A SUMO world in which the ego never enters; the slow leader does."""

    def drive(
        self, entry_steps: int, n_steps: int, ids: Set[str]
    ) -> Iterator[TrafficState]:
        """Run the traffic without the ego.

        Args:
            entry_steps: Steps after the warm-up until the ego would enter.
            n_steps: Moments to report, the first is that entry.
            ids: Of the vehicles reported, wherever they are.

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
            for moment in range(n_steps):
                if moment > 0:
                    sumo.simulationStep()
                found = reader.of(ids & set(sumo.vehicle.getIDList()))
                yield TrafficState(moment * self.step, found)
