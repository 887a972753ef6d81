"""Planners of others: `rearview run curved --planner rearview.peers:fiss_plus`."""

from experiments.api.peers import PeerPlanner, fiss, fiss_plus, fop, fop_plus

__all__ = ["PeerPlanner", "fiss", "fiss_plus", "fop", "fop_plus"]
