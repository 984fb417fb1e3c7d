"""Measured force-displacement records: reading, units, reversals and strokes."""

from .reading import read_record
from .record import Record

__all__ = ["Record", "read_record"]
