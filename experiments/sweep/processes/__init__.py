"""Child processes that can neither outlive their parent nor exceed their limits."""
