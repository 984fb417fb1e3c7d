"""modelDescription.xml of FMI 2.0 and 3.0 and the XML files beside it, made from the table of variables."""
