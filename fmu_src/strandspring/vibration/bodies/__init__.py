"""Rigid bodies on hysteretic mounts; static pose, modes, motion in time, steady vibration by harmonic balance."""
