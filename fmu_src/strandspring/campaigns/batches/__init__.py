"""Identification of many springs, each from a file of its own; one table of all."""
