"""SUMO's window: follows the ego, keeps the pace of time, shows the ego's plan."""

import math
from time import monotonic, sleep

from experiments.cosim.sumo.libsumo_api import Libsumo
from planner.states import Trajectory

PLAN_ID = "rearview.plan"  # of the line drawn in SUMO's window
PLAN_COLOUR = (213, 94, 0, 255)  # as in all pictures
PLAN_LAYER = 200  # above the vehicles
PLAN_WIDTH = 0.4  # [m]
VIEW = "View #0"
ZOOM = 1200


def follow(sumo: Libsumo, vehicle: str) -> None:
    """Let the window follow a vehicle."""
    sumo.gui.trackVehicle(VIEW, vehicle)
    sumo.gui.setZoom(VIEW, ZOOM)


def draw_plan(sumo: Libsumo, plan: Trajectory) -> None:
    """Draw a plan, replacing the one before."""
    points = list(zip(plan.x.tolist(), plan.y.tolist(), strict=True))
    if PLAN_ID in sumo.polygon.getIDList():
        sumo.polygon.setShape(PLAN_ID, points)
    else:
        look = PLAN_COLOUR, False, "plan", PLAN_LAYER, PLAN_WIDTH
        sumo.polygon.add(PLAN_ID, points, *look)


class Pace:
    """Makes a step take as long as it lasts.

    Args:
        step: Its duration [s].
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._shown_at = -math.inf  # when the last step was shown [s]

    def keep(self) -> None:
        """Wait until the next step is due."""
        now = monotonic()
        due = self._shown_at + self._step
        if now < due:
            sleep(due - now)
        self._shown_at = max(now, due)
