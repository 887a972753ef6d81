"""Errors of the experiments package; the command line turns them into one line."""


class ExperimentError(Exception):
    """Base of all errors of the experiments package."""


class ConfigError(ExperimentError, ValueError):
    """A scenario file or an option holds something that is not allowed."""


class SimulationError(ExperimentError):
    """The simulator refused or failed."""


class EntryError(SimulationError):
    """The ego found no room to enter the traffic."""


class ResultsError(ExperimentError):
    """A result could not be written or read."""


class ExecutorError(ExperimentError):
    """The workers of a sweep cannot be reached or are lost."""
