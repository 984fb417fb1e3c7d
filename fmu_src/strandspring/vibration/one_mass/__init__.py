"""A mass on hysteretic springs: static equilibrium, steady vibration, transmissibility; knows the model only."""
