"""[Thesis] ch. 6: changing lanes among vehicles that react."""
