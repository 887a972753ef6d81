"""Trajectory planning in the Frenet frame: numerics only, no simulator, no files."""
