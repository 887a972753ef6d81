"""Many egos in one simulation."""
