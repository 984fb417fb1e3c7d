"""The native FMU: C sources compiled for each platform, with no Python on the simulator's machine."""
