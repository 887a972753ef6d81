"""Rectangles and discs, and the distances between them."""
