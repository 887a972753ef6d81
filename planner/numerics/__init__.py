"""Compilation, interpolation and polynomials."""
