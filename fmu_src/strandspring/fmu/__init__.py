"""The FMU as a file: model description, documentation, checks and packages; knows nothing of identification."""
