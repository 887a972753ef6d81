"""Phases of a lane change: keep, seek, change."""
