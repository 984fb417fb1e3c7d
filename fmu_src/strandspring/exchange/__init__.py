"""Export of an identified spring to formats of other tools: SSP and Modelica."""
