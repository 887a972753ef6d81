"""Studies of the thesis: published numbers beside measured ones."""
