"""What Python users call: one function for each command, the spring, and results that explain themselves."""
