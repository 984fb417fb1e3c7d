"""Studies over masses, loads and springs."""
