"""Identify hysteretic springs from measured records and build FMUs of them."""
