"""Masses and bodies on springs: signals, one mass, rigid bodies, their description, verdicts."""
