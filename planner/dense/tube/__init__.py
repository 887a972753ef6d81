"""The drivable tube around a coarse path and the program inside it."""
