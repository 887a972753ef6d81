"""What is done to the drivers of SUMO's traffic before each step."""

from collections.abc import Set

from experiments.cosim.sumo.cooperation import Cooperation
from experiments.cosim.sumo.driver_errors import DriverError, DriverErrors
from experiments.cosim.sumo.ego_entry import EGO_ID
from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.cosim.sumo.relaxation import Relaxation
from experiments.cosim.sumo.settings import SumoSettings
from planner.interface import Indicator


class TrafficDrivers:
    """Lets drivers err, cooperate with the ego, and relax after it has cut in.

    Args:
        sumo: The running libsumo module.
        settings: Of the world.
        hidden: Vehicles of SUMO that are no traffic; may change.
    """

    def __init__(self, sumo: Libsumo, settings: SumoSettings, hidden: Set[str]) -> None:
        self._sumo = sumo
        self._settings = settings
        self._hidden = hidden
        errors = settings.errors
        self._errors = None if errors is None else DriverErrors(sumo, errors, hidden)
        self._relaxation: Relaxation | None = None
        self._cooperation: Cooperation | None = None

    @property
    def erring(self) -> tuple[tuple[str, DriverError], ...]:
        """Who errs now, and how, sorted by id."""
        return () if self._errors is None else self._errors.present()

    @property
    def log_weight(self) -> float | None:
        """Logarithm of the weight of a run with errors; None without errors."""
        return None if self._errors is None else self._errors.log_weight

    def meet_ego(self) -> None:
        """Let drivers react to an ego that has entered."""
        settings = self._settings
        if settings.relaxation > 0.0:
            self._relaxation = Relaxation(self._sumo, settings.relaxation)
        if settings.cooperation is not None:
            self._cooperation = Cooperation(
                self._sumo,
                settings.cooperation,
                EGO_ID,
                frozenset(self._hidden),
                left_hand=settings.road.lanes.left_hand,
            )

    def update(
        self,
        time: float,
        ego: tuple[float, float] | None,
        leaders: tuple[str, ...],
        indicator: Indicator,
    ) -> None:
        """Do it before a step.

        Args:
            time: Since the ego has entered [s].
            ego: Its front bumper [m]; None before it has entered.
            leaders: Names by which followers see it: its own, and its ghost's.
            indicator: What it shows.
        """
        if self._errors is not None:
            self._errors.update(float(self._sumo.simulation.getTime()), ego)
        if self._relaxation is not None:
            self._relaxation.update(time, leaders)
        if self._cooperation is not None:
            self._cooperation.update(time, indicator)
