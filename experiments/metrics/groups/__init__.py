"""The entries of the catalogue, one file for each group of metrics."""
