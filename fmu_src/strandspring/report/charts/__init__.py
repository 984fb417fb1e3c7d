"""The charts of a report: each function makes one from an `Evaluation`, or None where there is nothing to show."""
