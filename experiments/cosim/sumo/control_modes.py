"""How SUMO is told that a vehicle is moved by us, or by its own driver again."""

KEEP_ROUTE_EXACT = 3  # moveToXY: exact position, route kept
NO_CHECKS = 32  # setSpeedMode: obey the commanded speed
OWN_CHECKS = 31  # SUMO's default speed mode
OWN_SPEED = -1.0  # setSpeed: as SUMO's driver wants
NO_LANE_CHANGES = 0  # setLaneChangeMode
OWN_LANE_CHANGES = 1621  # SUMO's default lane change mode
NO_LIMIT = 100.0  # a maximal speed that no vehicle reaches [m/s]
