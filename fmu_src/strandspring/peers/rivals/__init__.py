"""Other classes of hysteresis models, fitted to the same records with equal care."""
