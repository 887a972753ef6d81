"""The lane-change parameters of `sumo_tuned` and `sumo_sublane`.

Both were chosen on development seeds. The files beside this one hold them with what
they were chosen among; `experiments.comparison.tuning` writes them.
"""

from functools import cache
from pathlib import Path
from typing import Any

from experiments.cosim.sumo.driver_settings import SumoDriverSettings
from experiments.storage.json_files import read_json

TUNED_FILE = Path(__file__).with_name("tuned_driver.json")  # LC2013
SUBLANE_FILE = Path(__file__).with_name("tuned_sublane.json")  # SL2015


@cache
def tuned_driver(file: Path = TUNED_FILE) -> SumoDriverSettings:
    """Return the settings of a file.

    Raises:
        ResultsError: If the file is missing or damaged.
    """
    settings: dict[str, Any] = read_json(file)["settings"]
    chosen: dict[str, Any] = {name: float(value) for name, value in settings.items()}
    return SumoDriverSettings(**chosen)
