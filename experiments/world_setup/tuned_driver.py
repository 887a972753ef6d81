"""The lane-change parameters of `sumo_tuned`, chosen on development seeds.

The file beside this one holds them with what they were chosen among;
`experiments.comparison.tuning` writes it.
"""

from functools import cache
from pathlib import Path
from typing import Any

from experiments.cosim.sumo.driver_settings import SumoDriverSettings
from experiments.storage.json_files import read_json

TUNED_FILE = Path(__file__).with_name("tuned_driver.json")


@cache
def tuned_driver() -> SumoDriverSettings:
    """Return the settings of the file.

    Raises:
        ResultsError: If the file is missing or damaged.
    """
    settings: dict[str, Any] = read_json(TUNED_FILE)["settings"]
    return SumoDriverSettings(
        strategic=float(settings["strategic"]),
        assertive=float(settings["assertive"]),
        cooperative=float(settings["cooperative"]),
    )
