"""Episodes of planners in simulated traffic; only this package knows SUMO and files."""
