"""Which gap of the lane beside to take, looking 30 s ahead."""
