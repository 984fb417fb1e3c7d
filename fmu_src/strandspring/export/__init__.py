"""The identified spring in the formats of other tools: SSP parameter values and Modelica."""
