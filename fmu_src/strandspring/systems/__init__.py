"""Rigid bodies on hysteretic mounts: rest, modes, shock and random vibration in time; verdicts against limits."""
