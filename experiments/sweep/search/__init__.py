"""Search for what breaks a planner: every trial is an ordinary run of a sweep."""
