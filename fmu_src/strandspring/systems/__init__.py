"""Rigid bodies on hysteretic mounts; static pose, modes, motion in time and steady vibration in all degrees of freedom."""
