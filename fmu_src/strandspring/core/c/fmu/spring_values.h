/* The start values of one spring's variables; the only source that differs from FMU to FMU. Here they are missing. */
.guid = "",
