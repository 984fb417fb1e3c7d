"""Standard gravity, for weights, accelerations in g, and forces in kilograms."""

STANDARD_GRAVITY = 9.80665  # [m/s^2]
