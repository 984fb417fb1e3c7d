"""Pulses, sines, random vibration and records as functions of time; shock response and power spectra."""
