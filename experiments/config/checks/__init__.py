"""What must agree between the sections of a scenario, one kind in each module."""
