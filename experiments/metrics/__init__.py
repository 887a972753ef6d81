"""Metrics: pure functions of a trace, one row of results an episode."""
