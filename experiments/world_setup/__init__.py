"""From a scenario to a road with obstacles and traffic, before anything moves."""
