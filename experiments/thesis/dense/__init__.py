"""Chapter 5: dense obstacles."""
