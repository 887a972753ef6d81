"""Planners on networks that nobody drew: made by netgenerate, driven, and counted."""
