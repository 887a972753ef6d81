"""SUMO's own note that the ego is over a lane line, and how it is cleared.

SUMO itself notes that the ego is over a line, but only in the step in which it moves
the ego from one lane object to another, and with a duration of lane changes it forgets
to take that back: long after, cars in the lane that the ego has left brake with all
they have when it passes them. Once the body is inside its lane, the ego is put into the
lane beside and back, which happens between two steps and clears the note. The note must
be gone, too, when the ego leaves the lanes of its route: SUMO 1.28 then forgets which
lanes the rear of a long body is in, but not those of the note, and the process dies as
soon as a vehicle there asks how far back the ego reaches.
"""

from experiments.cosim.sumo.lanes import INSIDE_JUNCTION, edge_of
from experiments.cosim.sumo.libsumo_api import Libsumo


def clear_note(sumo: Libsumo, ego_id: str) -> bool:
    """Make SUMO find anew which lanes the ego occupies; return whether it did."""
    name = str(sumo.vehicle.getLaneID(ego_id))
    if not name or name.startswith(INSIDE_JUNCTION):
        return False
    edge, index = edge_of(name), sumo.vehicle.getLaneIndex(ego_id)
    beside = index + 1 if index + 1 < sumo.edge.getLaneNumber(edge) else index - 1
    if beside >= 0:
        position = sumo.vehicle.getLanePosition(ego_id)
        other = f"{edge}_{beside}"
        # in a bend the lane beside may be shorter
        there = min(position, sumo.lane.getLength(other))
        sumo.vehicle.moveTo(ego_id, other, there)
        sumo.vehicle.moveTo(ego_id, name, position)
    return True
