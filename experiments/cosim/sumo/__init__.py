"""SUMO as a world; the only package that imports libsumo."""
