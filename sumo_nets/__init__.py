"""Road networks, routes through them and traffic on them: data first, plain records."""
