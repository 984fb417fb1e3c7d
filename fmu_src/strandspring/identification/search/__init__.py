"""The right minimum without initial values: starts, degrees, and what is physically possible."""
