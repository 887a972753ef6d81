"""Planners that stand for SUMO's own driver: what they plan is not driven."""

from typing import Final

SUMO: Final = "sumo"
SUMO_AS_SHIPPED: Final = "sumo_as_shipped"
SUMO_TUNED: Final = "sumo_tuned"
SUMO_SUBLANE: Final = "sumo_sublane"
SELF_DRIVEN: Final = (SUMO, SUMO_AS_SHIPPED, SUMO_TUNED, SUMO_SUBLANE)
