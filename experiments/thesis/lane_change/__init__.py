"""Chapter 6: lane change, curve models and speed planning."""
