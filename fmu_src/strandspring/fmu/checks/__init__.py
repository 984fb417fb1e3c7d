"""Whether an FMU is valid, is as it was built, and answers as the model does."""
