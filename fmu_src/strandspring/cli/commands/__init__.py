"""Commands, those of a subject in a module; each parses, calls and prints."""
