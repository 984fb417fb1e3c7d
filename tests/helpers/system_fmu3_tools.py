"""Of systems in FMI 3.0, kept for tests/systems."""

from system_fmu_tools import NativeSystem3

__all__ = ["NativeSystem3"]
