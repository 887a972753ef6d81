"""Environments of Gymnasium, and planners that drive by a trained policy."""
