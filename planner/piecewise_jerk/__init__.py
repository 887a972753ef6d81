"""Piecewise-jerk programs and their solvers."""
