"""The model file, and what it states."""
