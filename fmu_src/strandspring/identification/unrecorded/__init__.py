"""Loops that were not recorded: their energy, and the force on nested ones."""
