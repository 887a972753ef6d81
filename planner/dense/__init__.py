"""[Thesis] ch. 5: static obstacles in dense fields."""
