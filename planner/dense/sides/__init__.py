"""The sides on which obstacles are passed."""
