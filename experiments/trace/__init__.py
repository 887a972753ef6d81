"""The recorded episode: its schema, recording and files."""
