"""Identification of the spring from records; knows the model and the records, nothing of FMI."""
