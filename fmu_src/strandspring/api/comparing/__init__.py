"""Two springs or records beside each other."""
