"""Measured force-displacement records: reading, units, reversals and strokes."""
