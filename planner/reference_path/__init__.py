"""Reference paths, projection and the Frenet frame."""
