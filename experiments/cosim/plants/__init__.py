"""Vehicles that follow a plan as well as they can: models, actuators, controllers."""
