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


MESSAGE_LIMIT = 500  # characters


def described(error: BaseException) -> str:
    """Describe an error of anyone's code in one line; its `__str__` may fail too."""
    try:
        text = str(error)
    except BaseException as second:  # noqa: BLE001, anyone's code
        text = f"(its text raises {type(second).__name__})"
    name = type(error).__name__
    return in_one_line(f"{name}: {text}" if text else name)


def in_one_line(text: str) -> str:
    """Join the words of a message in one line of at most `MESSAGE_LIMIT` characters."""
    line = " ".join(text.split())
    return line if len(line) <= MESSAGE_LIMIT else f"{line[: MESSAGE_LIMIT - 3]}..."
