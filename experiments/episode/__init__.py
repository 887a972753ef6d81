"""One episode: scenario in, run folder out."""
