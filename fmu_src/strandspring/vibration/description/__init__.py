"""SYSTEM.toml; bodies, mounts, limits and load cases of a file, checked and read."""
