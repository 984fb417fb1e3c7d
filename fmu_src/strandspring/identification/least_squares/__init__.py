"""The fit of one spring from a start, with its linear problem about the minimum."""
