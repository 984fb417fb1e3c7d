"""The spring over whole paths, and its derivatives by the hysteresis parameters."""
