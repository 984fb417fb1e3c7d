"""What a mass on hysteretic springs does: rest, steady vibration, transmissibility; knows the model only."""
