"""Populations of drivers: their own traffic, and what it does to planners."""
