"""Sweeps: planning, executing and resuming many runs."""
