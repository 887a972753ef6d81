"""Checks that remove candidates: limits, clearance, gaps."""
