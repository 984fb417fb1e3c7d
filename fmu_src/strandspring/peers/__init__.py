"""What the identification is compared with: Ni's model and method, three-point formulas, filters."""
