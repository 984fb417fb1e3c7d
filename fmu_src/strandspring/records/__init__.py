"""Measured force-displacement records: dialect, columns, units and spikes."""
