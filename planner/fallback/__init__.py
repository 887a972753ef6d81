"""What is driven in a cycle that finds no plan: `ladder.fallback`."""
