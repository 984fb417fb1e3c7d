"""Hysteresis loops: strokes and cycles of records, the model's steady loop, figures of both; what is selected."""
