"""Hysteresis loops: strokes and cycles of records, the model's steady loop, and the figures of both; what is selected.

`loop` and `modelled` depend on the model only; `strokes` on arrays only; `cycles` and `measured` use records.
"""
