"""The published figures: sweeps, simulations and layouts, and the document of them."""
