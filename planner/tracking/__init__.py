"""Tracking controllers: from a plan and the ego's motion to steering and drive."""
