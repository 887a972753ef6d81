"""Terminal states of the candidates."""
