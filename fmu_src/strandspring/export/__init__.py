"""Export of an identified spring to formats of other tools: SSP parameter values and Modelica."""
