"""Reference drivers of UN Regulation 157: which collisions are preventable.

Four published models answer whether an attentive driver would have avoided a collision:
the competent and careful human, the formula of paragraph 5.2.5.2, Responsibility
Sensitive Safety, and the fuzzy safety model. They only brake. Each is a frozen
dataclass of its parameters with pure functions; arrays hold one number a conflict, so
that a whole grid of conflicts is judged at once. As planners they drive in any scene.

Apart from these, IDM with MOBIL (`idm_mobil`) drives as people usually do in traffic,
lane changes included: a baseline for planners.

Details that the sources leave open (how many steps the delay lasts, when braking ends,
at which gap a driver has passed) follow the reading that comes closest to the counts of
the published implementation of [Mattas2022]; they were chosen by that comparison, so
the agreement does not confirm them.

Sources:
    [R157] UN Regulation No. 157 (2021), 5.2.5.2 and Annex 4, Appendix 3.
    [Mattas2022] K. Mattas et al., Driver models for the definition of safety
        requirements of automated vehicles in international regulations. Accident
        Analysis and Prevention 174 (2022) 106743.
    [Mattas2020] K. Mattas et al., Fuzzy surrogate safety metrics for real-time
        assessment of rear-end collision risk. Accident Analysis and Prevention 148
        (2020) 105794.
    [Shalev2017] S. Shalev-Shwartz, S. Shammah, A. Shashua, On a formal model of safe
        and scalable self-driving cars. arXiv 1708.06374.
"""

from planner.reference_drivers.braking_planner import BrakingPlanner
from planner.reference_drivers.careful_human import CarefulHuman
from planner.reference_drivers.driver import DriverState, ReferenceDriver
from planner.reference_drivers.fuzzy_safety import FuzzySafety
from planner.reference_drivers.idm_mobil import IdmMobilPlanner, IdmMobilSettings
from planner.reference_drivers.regulation_157 import Regulation157
from planner.reference_drivers.rss import ResponsibilitySensitiveSafety
from planner.reference_drivers.situation import ConflictState

__all__ = [
    "BrakingPlanner",
    "CarefulHuman",
    "ConflictState",
    "DriverState",
    "FuzzySafety",
    "IdmMobilPlanner",
    "IdmMobilSettings",
    "ReferenceDriver",
    "Regulation157",
    "ResponsibilitySensitiveSafety",
]
