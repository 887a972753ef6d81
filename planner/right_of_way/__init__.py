"""Right of way at junctions without a signal of one's own."""
