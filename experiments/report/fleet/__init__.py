"""The page of a run with many egos."""
