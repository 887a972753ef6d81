"""[Thesis] ch. 5: static obstacles in dense fields."""

from dataclasses import replace

from planner.dense.planner import DensePlanner
from planner.dense.settings import DenseSettings, PathMethod


def proposed(settings: DenseSettings | None = None) -> DensePlanner:
    """Make the planner that searches the sides on which obstacles are passed."""
    return DensePlanner(settings or DenseSettings())


def adaptive(settings: DenseSettings | None = None) -> DensePlanner:
    """Make the planner with the adaptive lattice of [Thesis] 5.3-5.6."""
    return DensePlanner(
        replace(settings or DenseSettings(), method=PathMethod.ADAPTIVE)
    )


def uniform(settings: DenseSettings | None = None) -> DensePlanner:
    """Make the planner with the conventional lattice [104]."""
    return DensePlanner(replace(settings or DenseSettings(), method=PathMethod.UNIFORM))


__all__ = ["DensePlanner", "DenseSettings", "adaptive", "proposed", "uniform"]
