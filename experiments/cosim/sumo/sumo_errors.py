"""SUMO's exceptions as errors of ours, with what was being done."""

from types import TracebackType

from experiments.cosim.sumo.libsumo_api import Libsumo
from experiments.errors import SimulationError


class sumo_errors:  # noqa: N801 - reads as the function that it is used as
    """Turn SUMO's exceptions into ours; entered several times in every step.

    Args:
        sumo: The running libsumo module.
        doing: What fails, in words.
    """

    __slots__ = ("_doing", "_sumo")

    def __init__(self, sumo: Libsumo, doing: str) -> None:
        self._sumo = sumo
        self._doing = doing

    def __enter__(self) -> None:
        """Do nothing."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Raise an error of ours instead of one of SUMO's."""
        if error is None:
            return
        sumo = self._sumo
        if isinstance(error, (sumo.TraCIException, sumo.FatalTraCIError)):
            cause = " ".join(str(error).split())  # one line, also of a parser's report
            raise SimulationError(
                f"SUMO failed while {self._doing}: {cause}"
            ) from error
