"""Strokes, cycles and the figures that engineers read off a hysteresis loop, of records and of the model."""
