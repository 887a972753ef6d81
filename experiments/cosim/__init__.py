"""Co-simulation: one loop over a world, SUMO's or a SUMO-free one."""
