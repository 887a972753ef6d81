"""Figures for papers and films of runs."""
