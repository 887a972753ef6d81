"""Errors of the planner package.

Expected infeasibility is a `PlanStatus`, never one of these.
"""


class PlannerError(Exception):
    """Base of all errors of the planner package."""


class InvalidInputError(PlannerError, ValueError):
    """A value that the caller handed in is outside its allowed set."""


class OutsidePathDomainError(PlannerError, ValueError):
    """A point lies where the Frenet frame is undefined: 1 - kappa_r l <= 0."""
