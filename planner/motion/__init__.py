"""Motion over time: polynomials and predictions."""
