"""Folders, files and provenance of runs."""
