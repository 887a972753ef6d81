"""Reference drivers of UN Regulation 157: which collisions are preventable.

Four published models answer whether an attentive driver would have avoided a collision:
the competent and careful human, the formula of paragraph 5.2.5.2, Responsibility
Sensitive Safety, and the fuzzy safety model. They only brake. Each is a frozen
dataclass of its parameters with pure functions; arrays hold one number a conflict, so
that a whole grid of conflicts is judged at once. As planners they drive in any scene.

Apart from these, IDM with MOBIL (`idm_mobil`) drives as people usually do in traffic,
lane changes included: a baseline for planners.

Details that the papers leave open are those of the published implementation [JRC]: the
delay counts down by whole steps of danger and once only, so that 0.75 s last eight
steps of 0.1 s; between two dangers the speed is held and the brake keeps its level; a
position advances with the speed at the end of the step; lateral gaps of exactly 0 m
count as overlap for a driver's eye but not as a collision; the ego has passed when its
centre is ahead of the other's.

Sources:
    [R157] UN Regulation No. 157 (2021), 5.2.5.2 and Annex 4, Appendix 3.
    [Mattas2022] K. Mattas et al., Driver models for the definition of safety
        requirements of automated vehicles in international regulations. Accident
        Analysis and Prevention 174 (2022) 106743.
    [Mattas2020] K. Mattas et al., Fuzzy surrogate safety metrics for real-time
        assessment of rear-end collision risk. Accident Analysis and Prevention 148
        (2020) 105794.
    [JRC] Regulation 157 safety models, European Commission, Joint Research Centre,
        github.com/ec-jrc/JRC-FSM; read for its conventions, none of it is copied.
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
