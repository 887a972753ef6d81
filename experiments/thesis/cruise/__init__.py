"""Chapter 4: cruising with obstacles of different size."""
