"""What the identification is compared with: the paper's method, Ni's model and method."""
