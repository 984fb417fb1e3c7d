"""The FMU: variable table, model description, slave and package; knows the model, nothing of identification."""
