"""Planners by name or as `module:factory`, and the check of what they return."""
