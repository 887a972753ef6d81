"""The commands of `rearview`, apart from those of a single run."""
