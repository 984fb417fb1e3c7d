"""The FMU of rigid bodies on hysteretic mounts: base acceleration in, motion of points and forces of mounts out."""
