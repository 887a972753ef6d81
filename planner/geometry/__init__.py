"""Geometry of roads, vehicles and paths."""
