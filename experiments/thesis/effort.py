"""Amount of computation of a study."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Effort:
    """Numbers of random layouts, scenes and seeds."""

    cruise_layouts: int  # on each road
    traffic_seeds: int  # in SUMO, on each road; 0 leaves SUMO out
    moving_layouts: int  # on each road
    dense_layouts: int  # for each number of obstacles, of one size and of different
    scenes: int  # of the lane change; about a fifth of them leave a choice
    crowds: int  # scenes for each number of vehicles
    timing_repeats: int


FULL = Effort(150, 5, 25, 400, 1400, 40, 20)
QUICK = Effort(6, 0, 3, 15, 160, 5, 3)
