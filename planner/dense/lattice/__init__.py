"""The layered lattice of [Thesis] 5.3-5.6 and its search."""
