"""The page that compares runs: replayed over each other, curves, metrics, settings."""
