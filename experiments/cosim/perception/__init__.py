"""What the ego believes of other vehicles: sensors, noise, a tracker."""
